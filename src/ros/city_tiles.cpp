#include "ros/city_tiles.h"

#include <ros/console.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping::ros_interface {
namespace {

/// Tiles that are read at a time. Fewer arrive sooner; more need fewer searches.
constexpr std::size_t kTilesAtOnce = 32;
/// Fraction of a tile's edge that the sensor moves before the next search.
constexpr double kStep = 0.25;

/// Work::overhead before anything was read.
constexpr double kUsualOverhead = 2.0;

/// The edge of a tile [m].
double edgeOf(double resolution) {
  return Region::kEdge * kBlockEdge * resolution;
}

/// The cube that is wanted.
Eigen::AlignedBox3d cubeOf(const CityLoader::Wanted& wanted) {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(wanted.radius);
  return {wanted.sensor - half, wanted.sensor + half};
}

/// Adds a part to a map of the same city.
void add(StoredMap& map, StoredMap part) {
  map.map.add(std::move(part.map));
  for (DriveRecord& drive : part.drives) {
    const bool known = std::any_of(map.drives.begin(), map.drives.end(),
                                   [&](const DriveRecord& each) { return each.id == drive.id; });
    if (!known) map.drives.push_back(std::move(drive));
  }
}

}  // namespace

CityLoader::CityLoader(const std::string& path, const MapInfo& own)
    : path_(path), work_{TiledMap(path), {}, {}, kUsualOverhead} {
  const MapInfo& info = work_.map.info();
  if (info.frame != own.frame) {
    throw MapFileError("the city in " + path + " is in frame '" + info.frame + "', and the mapper maps in '" +
                       own.frame + "'; set frame_id to the frame of the city");
  }
  try {
    checkSameGrid(path, info, "the mapper", own);
  } catch (const std::invalid_argument& difference) {
    throw MapFileError(difference.what());
  }
  drives_ = work_.map.driveIds();
}

std::optional<StoredMap> CityLoader::update(const Wanted& wanted) {
  std::optional<StoredMap> arrived;
  if (job_.valid()) {
    if (job_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
    Result result = job_.get();
    if (std::exchange(forgets_, false)) {
      work_.done.clear();
    } else {
      if (!result.fault.empty()) fault_ = result.fault;
      full_ = result.full;
      complete_ = result.complete;
      tiles_ += result.tiles;
      if (result.tiles > 0) arrived = std::move(result.map);
    }
  }
  const double moved = (wanted.sensor - sensor_).cwiseAbs().maxCoeff();
  if (!complete_ || moved > kStep * edgeOf(work_.map.resolution()) || wanted.radius != radius_) {
    complete_ = false;
    sensor_ = wanted.sensor;
    radius_ = wanted.radius;
    const auto read_all = [this, wanted] {
      try {
        return read(work_, wanted);
      } catch (const std::exception& error) {  // as when memory is short
        Result result;
        result.fault = "no more of the city is loaded here: " + std::string(error.what());
        result.complete = true;  // until the sensor moves
        return result;
      }
    };
    try {
      job_ = std::async(std::launch::async, read_all);
    } catch (const std::system_error& error) {
      fault_ = "no more of the city is loaded here, because no thread can be started: " +
               std::string(error.what());
      complete_ = true;
    }
  }
  return arrived;
}

void CityLoader::forget() {
  complete_ = false;
  tiles_ = 0;
  if (job_.valid()) {
    forgets_ = true;
  } else {
    work_.done.clear();
  }
}

CityLoader::Result CityLoader::read(Work& work, const Wanted& wanted) {
  Result result;
  const Eigen::AlignedBox3d cube = cubeOf(wanted);
  std::vector<std::pair<double, TileEntry>> waiting;  // with their distance from the sensor
  const double edge = edgeOf(work.map.resolution());
  for (const std::size_t file : work.map.filesIn(cube)) {
    if (work.broken.count(file) > 0) continue;
    try {
      for (const TileEntry& tile : work.map.tilesIn(cube, file)) {
        if (work.done.count(tile.index) > 0) continue;
        const Eigen::Vector3d centre =
            edge * Eigen::Vector3d(tile.index.x + 0.5, tile.index.y + 0.5, tile.index.z + 0.5);
        waiting.emplace_back((centre - wanted.sensor).norm(), tile);
      }
    } catch (const MapFileError& error) {
      work.broken.insert(file);
      result.fault = error.what();
    }
  }
  std::sort(waiting.begin(), waiting.end(), [](const auto& a, const auto& b) {
    return std::make_pair(a.first, a.second.index) < std::make_pair(b.first, b.second.index);
  });
  result.complete = waiting.size() <= kTilesAtOnce;
  if (!result.complete) waiting.resize(kTilesAtOnce);
  double bytes = 0.0;
  std::vector<GridIndex> tiles;
  for (const auto& [distance, tile] : waiting) {
    const auto more = static_cast<double>(memoryOf(tile));
    if (work.overhead * (bytes + more) > wanted.room) {
      result.full =
          "the city is not loaded as far as map_load_radius, because memory_limit is reached; set "
          "own_map_file "
          "and window, lower map_load_radius, or raise memory_limit";
      result.complete = true;  // until the sensor moves
      break;
    }
    bytes += more;
    tiles.push_back(tile.index);
  }
  if (tiles.empty()) return result;
  try {
    result.map = work.map.readTiles(tiles);
  } catch (const MapFileError&) {
    result.map = work.map.readTiles({});
    for (const GridIndex& tile : tiles) {
      try {
        add(*result.map, work.map.readTiles({tile}));
      } catch (const MapFileError& error) {
        result.fault = error.what();
      }
    }
  } catch (const std::bad_alloc&) {
    result.full = "the computer's memory does not hold more of the city; lower map_load_radius";
    result.map.reset();
    result.complete = true;
    return result;
  }
  work.overhead = std::max(work.overhead, static_cast<double>(result.map->map.bytes()) / bytes);
  result.tiles = tiles.size();
  work.done.insert(tiles.begin(), tiles.end());
  return result;
}

bool namesCity(const std::string& path) {
  std::error_code unknown;
  const std::filesystem::path as_path(path);
  return !path.empty() && (path.back() == '/' || as_path.filename() == "index.json" ||
                           std::filesystem::is_directory(path, unknown));
}

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
