/// @file The part of a server's map that comes from a city.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ros/city_loader.h"

namespace bki_mapping::ros_interface {

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
