/// @file The map of the server over time: its window, its map file, and the drives in it.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/store/map_keeper.h"
#include "ros/server_config.h"

namespace bki_mapping::ros_interface {

/// Keeps the map of a mapper in the window, and in the map file if there is one. For the mapping thread.
class KeptMap {
 public:
  using Clock = std::chrono::steady_clock;

  /// Opens the map file, and loads it without a window or if it is read only.
  /// @param name of the drive that begins, for humans.
  /// @throws MapFileError; std::invalid_argument if settings contradict each other.
  KeptMap(SemanticMapper& mapper, const ServerConfig& config, const std::string& name);

  // Each returns the blocks that changed, for the publishers.
  /// Notes what a scan changed, and moves the window. @param stamp of the scan [ns].
  std::vector<GridIndex> addScan(std::uint64_t stamp, const Eigen::Vector3d& sensor,
                                 const ServerConfig& config);
  /// What there is to do without a scan: evidence arrives from the file, and the map is saved now and then.
  std::vector<GridIndex> update(const ServerConfig& config, Clock::time_point now);

  /// Makes room for a scan that was refused for lack of memory. @return whether that is possible.
  bool makeRoom() { return keeper_ && keeper_->makeRoom(); }
  /// Clears the map, also in the file, and begins a drive. @throws std::invalid_argument if it is read only.
  void reset();
  /// Adds a map. @param replace what was there before. @throws as MapKeeper::addMap; std::invalid_argument if
  /// the map is read only.
  void addMap(StoredMap map, bool replace);

  /// Clears a box. @param box map frame [m]. @return the blocks that changed. @throws std::invalid_argument
  /// if the map is read only.
  std::vector<GridIndex> clearBox(const Eigen::AlignedBox3d& box);

  /// What must be known to write the map to a file in another thread.
  struct Saving {
    MapInfo info;
    std::vector<DriveRecord> drives;
    std::future<void> done;  ///< ready when the map is written; invalid if that is left to the caller
  };
  /// Prepares to write the map to a map file, or writes it where a part of it is in the map file of the node.
  Saving saveTo(const std::string& path);

  bool hasFile() const { return keeper_ != nullptr; }
  bool readOnly() const { return read_only_; }
  /// What is wrong with the map file at present, in one sentence; "" if nothing is.
  std::string fault() const { return keeper_ ? keeper_->fault() : ""; }
  /// Wall time from which on nothing was added that the map file does not have; 0: never.
  ros::WallTime saved() const { return saved_; }
  /// Saves, and closes the map file. @return what was lost and why; "" if nothing was.
  std::string close() { return keeper_ ? keeper_->close() : ""; }

  /// What a map file says of this map.
  MapInfo info() const;

 private:
  DriveRecord newDrive() const;
  void requireWritable() const;

  SemanticMapper& mapper_;
  std::string frame_, name_;
  bool read_only_;
  MapKeeper::Window window_;
  DriveRecord drive_;                ///< without a keeper
  std::vector<DriveRecord> drives_;  ///< likewise, of maps that were added
  std::unique_ptr<MapKeeper> keeper_;
  bool unsaved_ = false;  ///< something has been added since the last save
  std::future<void> saving_;
  ros::WallTime saving_since_, saved_;
  Clock::time_point next_save_{};
};

}  // namespace bki_mapping::ros_interface
