#include "ros/kept_map.h"

#include <ros/console.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/store/mapper_file.h"
#include "ros/map_file_settings.h"
#include "store/drives.h"

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

/// A drive without scans. @param name for people; the time is added to it.
DriveRecord newDrive(const std::string& name) {
  DriveRecord drive;
  drive.id = newId();
  drive.name = name + " " + utcText();
  return drive;
}

/// Fraction of memory_limit up to which tiles of a city are loaded; the rest is for scans.
constexpr double kMostOfMemory = 0.8;

/// Scans that may wait for being written to the journal of the file, before a save is due.
constexpr std::size_t kMostUnsavedScans = 200;

/// While more than this waits to be written to the file [bytes], no scans move.
constexpr std::size_t kMostWaiting = 128 << 20;

bool samePath(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return std::filesystem::weakly_canonical(a, ignored) == std::filesystem::weakly_canonical(b, ignored);
}

}  // namespace

KeptMap::KeptMap(SemanticMapper& mapper, const ServerConfig& config, const std::string& name,
                 std::function<void()> wake)
    : mapper_(mapper),
      frame_(config.frame_id),
      name_(name),
      read_only_(config.read_only),
      drive_(newDrive(name)) {
  checkMapFileSettings(config);
  if (read_only_) {
    StoredMap stored = loadMapFor(mapper_, config.map_file, frame_);
    mapper_.addMap(std::move(stored.map));
    drives_ = stored.drives;
  } else if (namesCity(config.map_file)) {
    city_.open(config.map_file, info());
    if (!config.own_map_file.empty()) {
      if (std::filesystem::exists(config.own_map_file)) {
        throw MapFileError(
            config.own_map_file +
            " exists already, and may hold tiles of the city, which would count "
            "twice; continue it as map_file, without the city, or name a new file as own_map_file");
      }
      keeper_ = std::make_unique<MapKeeper>(mapper_, config.own_map_file, info(), drive_,
                                            config.correction.journal);
    }
  } else if (!config.map_file.empty()) {
    keeper_ =
        std::make_unique<MapKeeper>(mapper_, config.map_file, info(), drive_, config.correction.journal);
    if (config.window <= 0.0) {
      keeper_->moveTo(window_);
      keeper_->waitForTiles();
    }
  }
  if (!read_only_) beginJournal(config, std::move(wake));
  if (!config.map_file.empty() && !namesCity(config.map_file)) {
    ROS_INFO("The map is %s %s; %lu blocks are loaded", read_only_ ? "read from" : "kept in",
             config.map_file.c_str(), mapper_.map().size());
  }
}

void KeptMap::beginJournal(const ServerConfig& config, std::function<void()> wake) {
  if (!config.correction.journal) return;
  MapCorrector::Settings settings;
  settings.quantum = config.correction.journal_quantum;
  settings.tolerance = config.correction.tolerance;
  settings.memory = static_cast<std::size_t>(1e6 * config.correction.journal_limit);
  const auto add = [this](SemanticMap difference) {
    std::vector<GridIndex> changed;
    for (const auto& [index, block] : difference.entries()) changed.push_back(index);
    if (keeper_) {
      keeper_->change(std::move(difference));
    } else {
      drive_.addTouched(mapper_.map().geometry(), changed);
      mapper_.addMap(std::move(difference));
    }
    save_.noteChange();
    return changed;
  };
  const auto replaceLooks = [this](const GridIndex& region, const LooksByBlock& looks) {
    save_.noteChange();
    return keeper_ ? keeper_->replaceLooks(region, looks) : mapper_.replaceLooks(region, looks);
  };
  const auto ready = [this] { return !keeper_ || keeper_->waitingBytes() < kMostWaiting; };
  ScanMover::Fetch fetch;
  if (keeper_) {
    fetch = [this](std::uint64_t number) { return keeper_->scanContent(writer_->fileNumber(number)); };
  }
  corrector_ = std::make_unique<MapCorrector>(mapper_.config(), mapper_.sharedClasses(), settings,
                                              CorrectedMap{add, replaceLooks, ready, fetch, std::move(wake)});
  if (!keeper_) return;
  corrector_->noteForeign(keeper_->storedTiles());
  writer_ = std::make_unique<JournalWriter>(keeper_->journalSize(), drive_.id, mapper_.sharedClasses());
  keeper_->keepJournal([this] { return writer_->take(*corrector_, sensor_frames_); });
}

MapInfo KeptMap::info() const {
  return mapInfoOf(mapper_, frame_);
}

std::vector<GridIndex> KeptMap::addScan(std::uint64_t stamp, const Eigen::Vector3d& sensor,
                                        const ServerConfig& config) {
  has_pose_ = true;
  window_.centre = sensor;
  window_.edge = config.window > 0.0 ? config.window : MapKeeper::Window().edge;
  save_.noteChange();
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

std::vector<GridIndex> KeptMap::addFromCity(const ServerConfig& config) {
  std::vector<GridIndex> changed;
  if (!has_pose_ || !city_.isOpen()) return changed;
  CityLoader::Wanted wanted{window_.centre, config.map_load_radius};
  if (config.window > 0.0) wanted.radius = std::min(wanted.radius, 0.5 * config.window);
  const double limit = 1e6 * mapper_.config().memory_limit;
  const bool makes_room = keeper_ != nullptr;
  if (limit > 0.0 && !makes_room)
    wanted.room = kMostOfMemory * limit - static_cast<double>(mapper_.mapBytes());
  city_.update(wanted, !makes_room, [&](SemanticMap&& tiles, const std::vector<DriveRecord>& drives) {
    if (corrector_) corrector_->noteForeign(tiles.regions());
    if (keeper_) {
      keeper_->addMap(std::move(tiles), drives);
    } else {
      std::vector<GridIndex> added;
      for (const auto& [index, block] : tiles.entries()) added.push_back(index);
      mapper_.addMap(std::move(tiles));
      changed = std::move(added);
      drives_.insert(drives_.end(), drives.begin(), drives.end());
    }
    save_.noteChange();
  });
  return changed;
}

std::vector<GridIndex> KeptMap::update(const ServerConfig& config, PeriodicSave::Clock::time_point now,
                                       bool may_correct) {
  std::vector<GridIndex> changed = addFromCity(config);
  const auto add = [&](const std::vector<GridIndex>& more) {
    changed.insert(changed.end(), more.begin(), more.end());
  };
  if (corrector_) add(corrector_->update(window_.centre, may_correct));
  if (!keeper_) return changed;
  const bool due = keeper_->wantsSave() || (writer_ && journalIsDue(config.correction));
  save_.update(*keeper_, config.save_period, now, due);
  add(keeper_->moveTo(window_));
  return changed;
}

bool KeptMap::journalIsDue(const CorrectionConfig& config) const {
  const auto waiting = static_cast<double>(corrector_->journal().bytesNotStored());
  const bool fills_memory = config.journal_limit > 0.0 && waiting > 0.5e6 * config.journal_limit;
  return fills_memory || corrector_->unsavedScans() > kMostUnsavedScans;
}

bool KeptMap::makeRoom() {
  if (!keeper_ || !keeper_->makeRoom()) return false;
  if (writer_) save_.saveNow(*keeper_, PeriodicSave::Clock::now());  // until then, it takes memory
  return true;
}

std::uint64_t KeptMap::forgetJournal() {
  if (!corrector_) throw std::invalid_argument("no scans are kept; set journal to true to keep them");
  const std::uint64_t scans = corrector_->progress().scans;
  if (keeper_) keeper_->forgetJournal();
  corrector_->forget();
  if (writer_) writer_->reset(drive_.id);
  return scans;
}

void KeptMap::requireWritable() const {
  if (read_only_) throw std::invalid_argument("the map is read only; set read_only to false to change it");
}

void KeptMap::reset() {
  requireWritable();
  drive_ = newDrive(name_);
  drives_.clear();
  city_.reset();
  save_.noteChange();
  if (keeper_) {
    keeper_->reset(drive_);
  } else {
    mapper_.reset();
  }
  if (corrector_) corrector_->reset();
  if (writer_) writer_->reset(drive_.id);
}

void KeptMap::addMap(StoredMap map, bool replace, bool allow_overlap) {
  requireWritable();
  if (replace) {
    reset();
    city_.leave();
  }
  city_.checkHoldsNone(map.drives);
  save_.noteChange();
  const std::vector<GridIndex> regions = map.map.regions();
  if (keeper_) {
    keeper_->addMap(std::move(map.map), map.drives, allow_overlap);
    if (writer_) save_.saveNow(*keeper_, PeriodicSave::Clock::now());
  } else {
    checkNotAdded("the map", drives_, map.drives, allow_overlap);
    mapper_.addMap(std::move(map.map));
    drives_.insert(drives_.end(), map.drives.begin(), map.drives.end());
  }
  if (corrector_) corrector_->noteForeign(regions);
}

std::vector<GridIndex> KeptMap::clearBox(const Eigen::AlignedBox3d& box) {
  requireWritable();
  save_.noteChange();
  city_.clearBox(box);
  if (corrector_) corrector_->noteCleared(box);
  return keeper_ ? keeper_->clearBox(box) : mapper_.clearBox(box);
}

std::string KeptMap::fault() const {
  const std::string of_file = fileFault();
  return of_file.empty() ? city_.fault() : of_file;
}

KeptMap::Saving KeptMap::saveTo(const std::string& path) {
  Saving saving{info(), drives_, {}};
  if (drive_.scans > 0) saving.drives.push_back(drive_);
  if (keeper_) saving.done = samePath(path, keeper_->path()) ? keeper_->save() : keeper_->saveTo(path);
  return saving;
}

void PeriodicSave::update(MapKeeper& keeper, double period, Clock::time_point now, bool due) {
  if (saving_.valid() && saving_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    saving_.get();
    saved_ = saving_since_;
  }
  if (!due && (!unsaved_ || period <= 0.0 || now - begun_ < std::chrono::duration<double>(period))) return;
  saveNow(keeper, now);
}

void PeriodicSave::saveNow(MapKeeper& keeper, Clock::time_point now) {
  if (saving_.valid()) return;
  begun_ = now;
  saving_since_ = ros::WallTime::now();
  saving_ = keeper.save();
  unsaved_ = false;
}

}  // namespace bki_mapping::ros_interface
