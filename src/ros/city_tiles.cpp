#include "ros/city_tiles.h"

#include <ros/console.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <utility>

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping::ros_interface {

void CityTiles::open(const std::string& path, const MapInfo& own) {
  try {
    loader_ = std::make_unique<CityLoader>(path, own);
    ROS_INFO("The map near the sensor will be loaded from the city in %s", path.c_str());
  } catch (const MapFileError& error) {
    fault_ = std::string(error.what()) + " (mapping goes on without the city)";
  }
}

bool CityTiles::addArrived(bool tries_again, const Add& add) {
  try {
    for (const Eigen::AlignedBox3d& box : cleared_) bki_mapping::clearBox(arrived_->map, box);
    std::vector<DriveRecord> drives;
    for (const DriveRecord& drive : arrived_->drives) {
      if (added_drives_.count(drive.id) == 0) drives.push_back(drive);
    }
    add(std::move(arrived_->map), drives);
    for (const DriveRecord& drive : drives) added_drives_.insert(drive.id);
  } catch (const std::bad_alloc&) {
    if (tries_again) return false;
    fault_ =
        "the computer's memory does not hold what was read from the city, and some of its tiles are "
        "missing; lower map_load_radius and start again";
  } catch (const std::exception& error) {
    fault_ = error.what();
  }
  arrived_.reset();
  return true;
}

void CityTiles::update(const CityLoader::Wanted& wanted, bool tries_again, const Add& add) {
  if (!isOpen()) return;
  if (!arrived_) arrived_ = loader_->update(wanted);
  if (arrived_ && !addArrived(tries_again, add)) return;
  if (loader_->complete() && !std::exchange(said_loaded_, true)) {
    ROS_INFO("Loaded %lu tiles within %g m of the sensor from %s; more follow as it moves",
             loader_->tilesLoaded(), wanted.radius, loader_->path().c_str());
  }
}

void CityTiles::clearBox(const Eigen::AlignedBox3d& box) {
  const auto contains = [&](const Eigen::AlignedBox3d& each) { return each.contains(box); };
  if (!loader_ || std::any_of(cleared_.begin(), cleared_.end(), contains)) return;
  const auto inside = [&](const Eigen::AlignedBox3d& each) { return box.contains(each); };
  cleared_.erase(std::remove_if(cleared_.begin(), cleared_.end(), inside), cleared_.end());
  cleared_.push_back(box);
}

void CityTiles::reset() {
  arrived_.reset();
  added_drives_.clear();
  cleared_.clear();
  if (loader_) loader_->forget();
}

void CityTiles::checkHoldsNone(const std::vector<DriveRecord>& drives) const {
  for (const DriveRecord& drive : drives) {
    if (loader_ && loader_->holdsDrive(drive.id)) {
      throw std::invalid_argument("drive '" + drive.id + "' is in the city " + loader_->path() +
                                  ", from which this map is loaded, and would count twice");
    }
  }
}

}  // namespace bki_mapping::ros_interface
