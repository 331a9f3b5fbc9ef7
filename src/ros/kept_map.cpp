#include "ros/kept_map.h"

#include <ros/console.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>
#include <utility>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/store/mapper_file.h"
#include "store/drive_overlap.h"

namespace bki_mapping::ros_interface {
namespace {

/// Fraction of memory_limit up to which tiles of a city are loaded; the rest is for scans.
constexpr double kMostOfMemory = 0.8;

/// An id that no other drive of any robot has: a random UUID from the kernel.
std::string newId() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/uuid") >> id;
  if (id.empty()) throw std::runtime_error("/proc/sys/kernel/random/uuid gives no id for the drive");
  return id;
}

std::string utcText() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[sizeof "2000-01-01T00:00:00Z"];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

/// @param others what else the parameter may be.
void checkMapFilePath(const std::string& parameter, const std::string& path, const std::string& others = "") {
  if (path.front() != '/') {
    throw std::invalid_argument(parameter + " '" + path + "' must be an absolute path");
  }
  if (!isMapFileName(path))
    throw std::invalid_argument(parameter + " '" + path + "' must end in .bkm" + others);
}

void refuseInCity(const std::string& parameter, const std::string& path) {
  const std::string city = cityAround(path);
  if (city.empty()) return;
  throw std::invalid_argument(parameter + " '" + path + "' is in the city " + city +
                              ", which only map_city may change; name a file elsewhere, or the city itself");
}

void checkCitySettings(const ServerConfig& config) {
  if (config.map_file.front() != '/') {
    throw std::invalid_argument("map_file '" + config.map_file + "' must be an absolute path");
  }
  if (config.read_only) {
    throw std::invalid_argument(
        "read_only publishes a whole map, but a city is loaded near the sensor; set read_only "
        "to false, or name a map file (.bkm)");
  }
  if (config.window > 0.0 && config.own_map_file.empty()) {
    throw std::invalid_argument(
        "window moves evidence to a file, but a city is never changed; set own_map_file, or "
        "window to 0");
  }
  if (config.own_map_file.empty()) return;
  checkMapFilePath("own_map_file", config.own_map_file);
  refuseInCity("own_map_file", config.own_map_file);
}

bool samePath(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return std::filesystem::weakly_canonical(a, ignored) == std::filesystem::weakly_canonical(b, ignored);
}

}  // namespace

void KeptMap::checkSettings(const ServerConfig& config) {
  if (namesCity(config.map_file)) return checkCitySettings(config);
  if (!config.own_map_file.empty()) {
    throw std::invalid_argument(
        "own_map_file is for a mapper whose map_file is a city; set map_file to the folder of "
        "a city, or to '" +
        config.own_map_file + "' instead");
  }
  if (config.map_file.empty()) {
    if (config.read_only) throw std::invalid_argument("read_only needs a map; set map_file");
    return;
  }
  checkMapFilePath("map_file", config.map_file, ", or be the folder of a city");
  if (!config.read_only) refuseInCity("map_file", config.map_file);
}

KeptMap::KeptMap(SemanticMapper& mapper, const ServerConfig& config, const std::string& name)
    : mapper_(mapper),
      frame_(config.frame_id),
      name_(name),
      read_only_(config.read_only),
      drive_(newDrive()) {
  checkSettings(config);
  if (read_only_) {
    StoredMap stored = loadMapFor(mapper_, config.map_file, frame_);
    mapper_.addMap(std::move(stored.map));
    drives_ = stored.drives;
  } else if (namesCity(config.map_file)) {
    openCity(config.map_file);
    if (!config.own_map_file.empty()) {
      if (std::filesystem::exists(config.own_map_file)) {
        throw MapFileError(
            config.own_map_file +
            " exists already, and may hold tiles of the city, which would count "
            "twice; continue it as map_file, without the city, or name a new file as own_map_file");
      }
      keeper_ = std::make_unique<MapKeeper>(mapper_, config.own_map_file, info(), drive_);
    }
    return;
  } else if (!config.map_file.empty()) {
    keeper_ = std::make_unique<MapKeeper>(mapper_, config.map_file, info(), drive_);
    if (config.window <= 0.0) {
      keeper_->moveTo(window_);
      keeper_->waitForTiles();
    }
  }
  if (!config.map_file.empty()) {
    ROS_INFO("The map is %s %s; %lu blocks are loaded", read_only_ ? "read from" : "kept in",
             config.map_file.c_str(), mapper_.map().size());
  }
}

void KeptMap::openCity(const std::string& path) {
  try {
    city_ = std::make_unique<CityLoader>(path, info());
    ROS_INFO("The map near the sensor will be loaded from the city in %s", path.c_str());
  } catch (const MapFileError& error) {
    city_fault_ = std::string(error.what()) + " (mapping goes on without the city)";
  }
}

DriveRecord KeptMap::newDrive() const {
  DriveRecord drive;
  drive.id = newId();
  drive.name = name_ + " " + utcText();
  return drive;
}

MapInfo KeptMap::info() const {
  return mapInfoOf(mapper_, frame_);
}

std::vector<GridIndex> KeptMap::addScan(std::uint64_t stamp, const Eigen::Vector3d& sensor,
                                        const ServerConfig& config) {
  has_pose_ = true;
  window_.centre = sensor;
  window_.edge = config.window > 0.0 ? config.window : MapKeeper::Window().edge;
  unsaved_ = true;
  if (keeper_) {
    keeper_->addScan(stamp);
    return keeper_->moveTo(window_);
  }
  const GridGeometry& geometry = mapper_.map().geometry();
  drive_.addScan(stamp, geometry, mapper_.touchedBlocks());
  if (config.window <= 0.0) return {};
  const double reach = 0.5 * (window_.edge + geometry.blockSize());
  return mapper_.eraseBlocks([&](const BlockIndex& block) {
    return (geometry.blockCentre(block) - sensor).cwiseAbs().maxCoeff() > reach;
  });
}

void KeptMap::add(StoredMap& tiles, std::vector<GridIndex>& changed) {
  for (const Eigen::AlignedBox3d& box : cleared_) bki_mapping::clearBox(tiles.map, box);
  std::vector<DriveRecord> drives;
  for (const DriveRecord& drive : tiles.drives) {
    if (city_drives_.count(drive.id) == 0) drives.push_back(drive);
  }
  if (keeper_) {
    keeper_->addMap(std::move(tiles.map), drives);
  } else {
    for (const auto& [index, block] : tiles.map.entries()) changed.push_back(index);
    mapper_.addMap(std::move(tiles.map));
    drives_.insert(drives_.end(), drives.begin(), drives.end());
  }
  for (const DriveRecord& drive : drives) city_drives_.insert(drive.id);
  unsaved_ = true;
}

std::vector<GridIndex> KeptMap::addFromCity(const ServerConfig& config) {
  std::vector<GridIndex> changed;
  if (!city_ || !has_pose_) return changed;
  if (!arrived_) {
    CityLoader::Wanted wanted{window_.centre, config.map_load_radius};
    if (config.window > 0.0) wanted.radius = std::min(wanted.radius, 0.5 * config.window);
    const double limit = 1e6 * mapper_.config().memory_limit;
    // A keeper makes room by itself.
    if (limit > 0.0 && !keeper_)
      wanted.room = kMostOfMemory * limit - static_cast<double>(mapper_.mapBytes());
    arrived_ = city_->update(wanted);
  }
  if (arrived_) {
    try {
      add(*arrived_, changed);
    } catch (const std::bad_alloc&) {
      if (!keeper_) return {};  // nothing was added; tries again when there is memory
      city_fault_ =
          "the computer's memory does not hold what was read from the city, and some of its tiles are "
          "missing; lower map_load_radius and start again";
    } catch (const std::exception& error) {
      city_fault_ = error.what();
    }
    arrived_.reset();
  }
  if (city_->complete() && !std::exchange(said_loaded_, true)) {
    ROS_INFO("Loaded %lu tiles within %g m of the sensor from %s; more follow as it moves",
             city_->tilesLoaded(), config.map_load_radius, city_->path().c_str());
  }
  return changed;
}

std::vector<GridIndex> KeptMap::update(const ServerConfig& config, Clock::time_point now) {
  std::vector<GridIndex> loaded = addFromCity(config);
  if (!keeper_) return loaded;
  if (saving_.valid() && saving_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    saving_.get();
    saved_ = saving_since_;
  }
  if (unsaved_ && !saving_.valid() && config.save_period > 0.0 && now >= next_save_) {
    next_save_ =
        now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(config.save_period));
    saving_since_ = ros::WallTime::now();
    saving_ = keeper_->save();
    unsaved_ = false;
  }
  return keeper_->moveTo(window_);
}

void KeptMap::requireWritable() const {
  if (read_only_) throw std::invalid_argument("the map is read only; set read_only to false to change it");
}

void KeptMap::reset() {
  requireWritable();
  drive_ = newDrive();
  drives_.clear();
  arrived_.reset();
  city_drives_.clear();
  cleared_.clear();
  if (city_) city_->forget();
  unsaved_ = true;
  if (keeper_) {
    keeper_->reset(drive_);
  } else {
    mapper_.reset();
  }
}

void KeptMap::addMap(StoredMap map, bool replace, bool allow_overlap) {
  requireWritable();
  if (replace) {
    reset();
    city_.reset();
  }
  for (const DriveRecord& added : map.drives) {
    if (city_ && city_->holdsDrive(added.id)) {
      throw std::invalid_argument("drive '" + added.id + "' is in the city " + city_->path() +
                                  ", from which this map is loaded, and would count twice");
    }
  }
  unsaved_ = true;
  if (keeper_) return keeper_->addMap(std::move(map.map), map.drives, allow_overlap);
  checkNotAdded("the map", drives_, map.drives, allow_overlap);
  mapper_.addMap(std::move(map.map));
  drives_.insert(drives_.end(), map.drives.begin(), map.drives.end());
}

std::vector<GridIndex> KeptMap::clearBox(const Eigen::AlignedBox3d& box) {
  requireWritable();
  unsaved_ = true;
  const auto contains = [&](const Eigen::AlignedBox3d& each) { return each.contains(box); };
  if (city_ && std::none_of(cleared_.begin(), cleared_.end(), contains)) {
    const auto inside = [&](const Eigen::AlignedBox3d& each) { return box.contains(each); };
    cleared_.erase(std::remove_if(cleared_.begin(), cleared_.end(), inside), cleared_.end());
    cleared_.push_back(box);
  }
  return keeper_ ? keeper_->clearBox(box) : mapper_.clearBox(box);
}

std::string KeptMap::fault() const {
  const std::string of_file = fileFault();
  if (!of_file.empty()) return of_file;
  return city_fault_.empty() && city_ ? city_->fault() : city_fault_;
}

KeptMap::Saving KeptMap::saveTo(const std::string& path) {
  Saving saving{info(), drives_, {}};
  if (drive_.scans > 0) saving.drives.push_back(drive_);
  if (keeper_) saving.done = samePath(path, keeper_->path()) ? keeper_->save() : keeper_->saveTo(path);
  return saving;
}

}  // namespace bki_mapping::ros_interface
