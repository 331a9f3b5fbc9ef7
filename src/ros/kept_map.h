/// @file The map of the server over time: in memory, in a map file, or read only, and the drives in it.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/store/map_keeper.h"
#include "journal/journal_writer.h"
#include "journal/map_corrector.h"
#include "ros/city_tiles.h"
#include "ros/server_config.h"

namespace bki_mapping::ros_interface {

/// Begins a save when one is due and something has changed, one at a time. Never waits for the disk.
class PeriodicSave {
 public:
  using Clock = std::chrono::steady_clock;

  /// Notes that the map has evidence that is not saved.
  void noteChange() { unsaved_ = true; }
  /// @param period [s]; 0: never. @param due whether to save before it has passed.
  void update(MapKeeper& keeper, double period, Clock::time_point now, bool due = false);
  /// Begins a save, unless one is under way.
  void saveNow(MapKeeper& keeper, Clock::time_point now);
  /// Wall time up to which everything is saved; 0: nothing was saved yet.
  ros::WallTime saved() const { return saved_; }

 private:
  bool unsaved_ = false;
  std::future<void> saving_;
  ros::WallTime saving_since_, saved_;
  Clock::time_point begun_{};
};

/// Keeps the map of a mapper in the window, and in the map file if there is one. If the map file is a city,
/// loads what is near the sensor from it, and keeps the map in a file of the mapper's own, or only in memory;
/// the map is then the sum of the tiles that were loaded, each once, and of all scans. For the mapping
/// thread.
class KeptMap {
 public:
  /// Opens the map file, and loads it if there is no window or the map is read-only. A city that cannot be
  /// used becomes a fault(), and mapping goes on without it.
  /// @param name of the drive that begins, for people.
  /// @throws MapFileError; std::invalid_argument as checkMapFileSettings().
  /// @param wake is called by another thread when update() has something to do.
  KeptMap(SemanticMapper& mapper, const ServerConfig& config, const std::string& name,
          std::function<void()> wake = {});
  ~KeptMap() { close(); }

  // These return the blocks that changed, for the publishers.
  /// Notes what a scan changed, and moves the window. @param stamp of the scan [ns].
  std::vector<GridIndex> addScan(std::uint64_t stamp, const Eigen::Vector3d& sensor,
                                 const ServerConfig& config);
  /// Does what is due between scans: adds evidence that has been read from the file, and what corrected poses
  /// change, and saves the map. @param may_correct whether the map may change by corrected poses now, which
  /// takes some ten milliseconds.
  std::vector<GridIndex> update(const ServerConfig& config, PeriodicSave::Clock::time_point now,
                                bool may_correct = true);

  /// Keeps the scans and moves them to corrected poses; nullptr without the parameter journal.
  MapCorrector* corrector() { return corrector_.get(); }
  /// Sets the frames of the sensors, by their numbers in the corrector, for the journal in the map file.
  void nameSensors(std::vector<std::string> frames) { sensor_frames_ = std::move(frames); }
  const MapCorrector* corrector() const { return corrector_.get(); }

  /// Forgets the scans of the journal, also in the map file. @return their number, as far as they are of this
  /// drive. @throws std::invalid_argument if there is no journal.
  std::uint64_t forgetJournal();
  /// Makes room for a scan that was refused for lack of memory. @return whether memory was gained.
  bool makeRoom();
  /// Clears the map, also in the file, and begins a drive. @throws std::invalid_argument if it is read only.
  void reset();
  /// Adds a map. @param replace what was there before. @param allow_overlap as MapKeeper::addMap. @throws as
  /// MapKeeper::addMap; std::invalid_argument if the map is read only.
  void addMap(StoredMap map, bool replace, bool allow_overlap = false);

  /// Clears a box. @param box map frame [m]. @return the blocks that changed. @throws std::invalid_argument
  /// if the map is read only.
  std::vector<GridIndex> clearBox(const Eigen::AlignedBox3d& box);

  /// The data with which another thread can write the map to a file.
  struct Saving {
    MapInfo info;
    std::vector<DriveRecord> drives;
    std::future<void> done;  ///< ready when the map is written; invalid if the caller has to write it
  };
  /// Prepares the data for another thread, or, if a part of the map is in the node's map file, writes the
  /// map.
  Saving saveTo(const std::string& path);

  /// Whether tiles of a city that are near the sensor are still missing; update() adds them.
  bool isLoading() const { return has_pose_ && city_.isLoading(); }
  bool hasFile() const { return keeper_ != nullptr; }
  /// The file that the map is kept in; hasFile() must be true.
  const std::string& filePath() const { return keeper_->path(); }
  bool readOnly() const { return read_only_; }
  /// What is wrong with the map file or the city at the moment, in one sentence; "" if nothing is.
  std::string fault() const;
  /// The same of the map file only, which a city cannot keep from being saved.
  std::string fileFault() const { return keeper_ ? keeper_->fault() : ""; }
  /// Wall time up to which the map file has everything that was added; 0: nothing was saved yet.
  ros::WallTime saved() const { return save_.saved(); }
  /// Saves and closes the map file. @return what was lost, and why; "" if nothing was.
  std::string close() { return keeper_ ? keeper_->close() : ""; }

  /// The info that a map file needs about this map.
  MapInfo info() const;

 private:
  void requireWritable() const;
  /// Begins the journal. @throws std::logic_error if the settings do not allow one.
  void beginJournal(const ServerConfig& config, std::function<void()> wake);
  /// Whether scans that wait for being written should be saved soon.
  bool journalIsDue(const CorrectionConfig& config) const;
  /// Adds the tiles that have been read from the city. @return the blocks that changed; none with a keeper,
  /// which reports them itself.
  std::vector<GridIndex> addFromCity(const ServerConfig& config);

  SemanticMapper& mapper_;
  std::string frame_, name_;
  bool read_only_;
  MapKeeper::Window window_;
  bool has_pose_ = false;
  DriveRecord drive_;                  ///< without a keeper
  std::vector<DriveRecord> drives_;    ///< of maps that were added, without a keeper
  std::unique_ptr<MapKeeper> keeper_;  ///< nullptr: the map is in memory only
  PeriodicSave save_;
  CityTiles city_;
  std::unique_ptr<JournalWriter> writer_;  ///< of a journal in a file
  std::vector<std::string> sensor_frames_;
  std::unique_ptr<MapCorrector> corrector_;  ///< last, because it changes what is above
};

}  // namespace bki_mapping::ros_interface
