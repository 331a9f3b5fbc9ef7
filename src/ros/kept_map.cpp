#include "ros/kept_map.h"

#include <ros/console.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "bki_mapping/io/mapper_file.h"

namespace bki_mapping::ros_interface {
namespace {

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

void checkSettings(const ServerConfig& config) {
  if (config.map_file.empty()) {
    if (config.read_only) throw std::invalid_argument("read_only needs a map; set map_file");
    return;
  }
  if (config.map_file.front() != '/') {
    throw std::invalid_argument("map_file '" + config.map_file + "' must be an absolute path");
  }
  if (!isMapFileName(config.map_file)) {
    throw std::invalid_argument("map_file '" + config.map_file + "' must end in .bkm");
  }
}

bool samePath(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return std::filesystem::weakly_canonical(a, ignored) == std::filesystem::weakly_canonical(b, ignored);
}

}  // namespace

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

std::vector<GridIndex> KeptMap::update(const ServerConfig& config, Clock::time_point now) {
  if (!keeper_) return {};
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
  unsaved_ = true;
  if (keeper_) {
    keeper_->reset(drive_);
  } else {
    mapper_.reset();
  }
}

void KeptMap::addMap(StoredMap map, bool replace) {
  requireWritable();
  if (replace) reset();
  unsaved_ = true;
  if (keeper_) return keeper_->addMap(std::move(map.map), map.drives);
  for (const DriveRecord& known : drives_) {
    for (const DriveRecord& added : map.drives) {
      if (known.id == added.id) {
        throw std::invalid_argument("drive '" + added.id + "' is in the map already");
      }
    }
  }
  mapper_.addMap(std::move(map.map));
  drives_.insert(drives_.end(), map.drives.begin(), map.drives.end());
}

std::vector<GridIndex> KeptMap::clearBox(const Eigen::AlignedBox3d& box) {
  requireWritable();
  unsaved_ = true;
  return keeper_ ? keeper_->clearBox(box) : mapper_.clearBox(box);
}

KeptMap::Saving KeptMap::saveTo(const std::string& path) {
  Saving saving{info(), drives_, {}};
  if (drive_.scans > 0) saving.drives.push_back(drive_);
  if (keeper_) saving.done = samePath(path, keeper_->path()) ? keeper_->save() : keeper_->saveTo(path);
  return saving;
}

}  // namespace bki_mapping::ros_interface
