/// @file The part of a server's map that comes from a city, whose tiles are loaded while mapping goes on.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/city/tiled_map.h"

namespace bki_mapping::ros_interface {

/// Reads each tile of a city once, the nearest first, some at a time and on a thread of its own, so that no
/// scan waits for the disk. For the mapping thread. The city is never written to.
class CityLoader {
 public:
  /// Opens a city. @param path of its folder. @param own describes the mapper's map.
  /// @throws MapFileError if it is no city, or has another grid, class table or frame.
  CityLoader(const std::string& path, const MapInfo& own);

  /// What is to be loaded.
  struct Wanted {
    Eigen::Vector3d sensor;                                 ///< map frame [m]
    double radius;                                          ///< distance from the sensor, along each axis [m]
    double room = std::numeric_limits<double>::infinity();  ///< memory for more tiles [bytes]
  };
  /// Takes the tiles that have been read since the last call, and begins to read the next ones. Call it
  /// often; it returns at once. Tiles that are returned are not read again before forget().
  std::optional<StoredMap> update(const Wanted& wanted);
  /// Reads all tiles again, as after a reset of the map.
  void forget();

  /// Whether the city contains a drive with this id.
  bool holdsDrive(const std::string& id) const { return drives_.count(id) > 0; }
  /// Whether all tiles that were wanted have been returned.
  bool complete() const { return complete_ && !job_.valid(); }
  std::size_t tilesLoaded() const { return tiles_; }
  const std::string& path() const { return path_; }
  /// What cannot be loaded, in one sentence; "" if everything can.
  std::string fault() const { return fault_.empty() ? full_ : fault_; }

 private:
  /// What the thread works with; the mapping thread stays away from it meanwhile.
  struct Work {
    TiledMap map;
    std::set<GridIndex> done;      ///< tiles that were read, or cannot be
    std::set<std::size_t> broken;  ///< numbers of files that cannot be read
    /// Memory of tiles in a map, in relation to memoryOf(), which knows no spare capacity: the most seen.
    double overhead;
  };
  struct Result {
    std::optional<StoredMap> map;
    std::size_t tiles = 0;
    bool complete = false;    ///< whether no other tile is wanted
    std::string fault, full;  ///< of files, and of memory
  };
  static Result read(Work& work, const Wanted& wanted);

  std::string path_;
  Work work_;
  std::set<std::string> drives_;
  std::size_t tiles_ = 0;
  bool complete_ = false, forgets_ = false;
  Eigen::Vector3d sensor_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  double radius_ = 0.0;
  std::string fault_, full_;
  std::future<Result> job_;  ///< destroyed first: it waits for the thread
};

/// Whether a path names a city instead of a map file: a folder, an index.json, or a path that ends in '/'.
bool namesCity(const std::string& path);

/// The tiles of a city in a map, each added once. Without a city, nothing happens.
class CityTiles {
 public:
  /// Opens a city. If it cannot be used, that becomes a fault(), and mapping goes on without it.
  /// @param own describes the mapper's map.
  void open(const std::string& path, const MapInfo& own);

  bool isOpen() const { return loader_ != nullptr; }

  /// Adds tiles to the map, with the drives that were not added before.
  using Add = std::function<void(SemanticMap&& tiles, const std::vector<DriveRecord>& drives)>;
  /// Adds the tiles that have been read, and begins to read those that are wanted.
  /// @param tries_again tiles for which there is no memory stay here and are added later; otherwise they are
  /// lost, which becomes a fault().
  void update(const CityLoader::Wanted& wanted, bool tries_again, const Add& add);
  /// Clears a box in the tiles that are added from now on, too.
  void clearBox(const Eigen::AlignedBox3d& box);
  /// Begins again, as after a reset of the map.
  void reset();
  /// Adds nothing of the city from now on.
  void leave() { loader_ = nullptr; }

  /// Whether tiles that are wanted are still missing.
  bool isLoading() const { return loader_ && (arrived_ || !loader_->complete()); }
  /// @throws std::invalid_argument if the city holds one of the drives, which would then count twice.
  void checkHoldsNone(const std::vector<DriveRecord>& drives) const;
  /// What is wrong with the city, in one sentence; "" if nothing is.
  std::string fault() const { return fault_.empty() && loader_ ? loader_->fault() : fault_; }

 private:
  /// Adds the tiles that have arrived. @return false if they are to be added later.
  bool addArrived(bool tries_again, const Add& add);

  std::unique_ptr<CityLoader> loader_;
  std::string fault_;
  std::optional<StoredMap> arrived_;          ///< tiles that are not in the map yet
  std::set<std::string> added_drives_;        ///< ids
  std::vector<Eigen::AlignedBox3d> cleared_;  ///< boxes
  bool said_loaded_ = false;
};

}  // namespace bki_mapping::ros_interface
