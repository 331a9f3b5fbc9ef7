#include "journal/map_corrector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/stopwatch.h"
#include "journal/scan_codec.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {
namespace {

/// Scans that are packed at once.
constexpr std::size_t kPackedAtOnce = 4;
/// Scans that are moved at once. More share the work of changing blocks, but hold up the mapper for longer
/// when their difference is added.
constexpr std::size_t kMovesAtOnce = 2;
/// Jobs for the thread at once: it goes on while the mapper has no time to take what is done.
constexpr std::size_t kMostJobs = 3;
/// Scans under way at once: the difference of each takes some ten megabytes.
constexpr std::size_t kMostUnderWay = 2 * kMovesAtOnce;
/// Scans of equal priority [m]: of those within this distance of each other, the newest are moved first.
constexpr double kEquallyNear = 20.0;
/// Scans that may wait for being packed: a raw one takes ten times the memory.
constexpr std::size_t kMostUnpacked = 20;
/// Errors below are rounding [m].
constexpr double kNoError = 1e-9;

/// Equal, or both not a number.
bool sameNumber(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

}  // namespace

MapCorrector::MapCorrector(const MapperConfig& config, std::shared_ptr<const ClassTable> classes,
                           const Settings& settings, CorrectedMap map)
    : settings_(settings),
      map_(std::move(map)),
      journal_(settings.memory, map_.fetch != nullptr),
      looks_(config, journal_, settings.looks_memory),
      mover_(std::make_unique<ScanMover>(config, std::move(classes), map_.fetch)) {
  if (!(settings_.quantum > 0.0)) settings_.quantum = usualQuantum(config.resolution);
  if (settings_.tolerance < 0.0) settings_.tolerance = 0.1 * config.resolution;
  reconfigure(config);
  thread_ = std::thread(&MapCorrector::work, this);
}

MapCorrector::~MapCorrector() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void MapCorrector::checkCorrectable(const MapperConfig& config) {
  const bool mapped =
      config.free_space.mode == "line" && config.free_space.extent == FreeSpaceExtent::kMapped;
  if (!mapped && config.occlusion == OcclusionExtent::kNone) return;
  throw std::invalid_argument(
      std::string("scans cannot move with ") + (mapped ? "free_space/extent: mapped" : "occlusion marks") +
      ", which depend on the order of scans; set " +
      (mapped ? "free_space/extent: observed" : "occlusion: none") + ", or do without the journal");
}

RoundedScan MapCorrector::round(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor) const {
  return toSensorScan(scan, T_map_sensor, settings_.quantum, config_->sensor_model);
}

RoundedScan MapCorrector::roundRecorded(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor) const {
  RoundedScan rounded = round(scan, Eigen::Isometry3d::Identity());
  rounded.T_map_sensor = roundedPose(T_map_sensor);
  return rounded;
}

void MapCorrector::addScan(SensorScan scan, std::size_t sensor, const Eigen::Isometry3d& T_map_sensor,
                           const Eigen::Isometry3d& T_odometry_sensor,
                           const std::vector<GridIndex>& touched) {
  JournalScan entry;
  entry.stamp = scan.stamp;
  entry.settings = config_;
  entry.sensor = sensor;
  entry.T_map_sensor = T_map_sensor;
  entry.T_odometry_sensor = T_odometry_sensor;
  entry.reach = reachOf(scan, config_->sensor_model);
  entry.regions = regionsOf(touched);
  entry.scan = std::make_shared<const SensorScan>(std::move(scan));
  const Number number = journal_.add(std::move(entry));
  unpacked_.push_back(number);
  changes_.added.push_back(number);
  looks_.noteAdded(number);
}

void MapCorrector::restore(JournalScan scan) {
  const std::size_t cleared_before = scan.cleared_before;
  const Number number = journal_.add(std::move(scan));
  journal_.at(number).cleared_before = cleared_before;
}

void MapCorrector::reconfigure(const MapperConfig& config) {
  checkCorrectable(config);
  config_ = std::make_shared<const MapperConfig>(config);
  gate_if_needed_ = threadCount(config.threads) < threadCount(0) ? nullptr : &gate_;
}

void MapCorrector::noteCleared(const Eigen::AlignedBox3d& box) {
  journal_.noteCleared(box);
  ++generation_;
  looks_.noteCleared();
}

void MapCorrector::noteForeign(const std::vector<GridIndex>& regions) {
  journal_.noteForeign(regions);
}

void MapCorrector::reset() {
  journal_.clear();
  changes_ = {};
  unpacked_.clear();
  looks_.reset();
  ++generation_;
  alone_ = false;
  progress_.to_go = progress_.failed = 0;
  progress_.fault.clear();
}

void MapCorrector::forget() {
  std::set<GridIndex> regions = journal_.foreign();
  for (Number n = journal_.begin(); n < journal_.end(); ++n) {
    regions.insert(journal_.at(n).regions.begin(), journal_.at(n).regions.end());
  }
  reset();
  journal_.noteForeign({regions.begin(), regions.end()});
}

bool MapCorrector::correct(const std::vector<StampedMotion>& keyframes,
                           const std::vector<Eigen::Isometry3d>& T_sensor_keyframe) {
  if (!journal_.setPath(keyframes, T_sensor_keyframe)) return false;
  markAll();
  return true;
}

void MapCorrector::correctTo(const std::vector<Eigen::Isometry3d>& T_map_sensor) {
  if (T_map_sensor.size() != journal_.size()) {
    throw std::invalid_argument("there are " + std::to_string(T_map_sensor.size()) + " poses for " +
                                std::to_string(journal_.size()) + " scans");
  }
  for (Number n = journal_.begin(); n < journal_.end(); ++n) {
    journal_.at(n).wanted = roundedPose(T_map_sensor[n - journal_.begin()]);
  }
  markAll();
}

void MapCorrector::markAll() {
  ++progress_.paths;
  progress_.largest_move = 0.0;
  progress_.done_around = false;
  bool more = false;
  for (Number n = journal_.begin(); n < journal_.end(); ++n) {
    const bool was_off = journal_.at(n).off;
    mark(journal_.at(n));
    more = more || (journal_.at(n).off && !was_off);
    progress_.largest_move = std::max(progress_.largest_move, ScanJournal::errorOf(journal_.at(n)));
  }
  if (more) looks_.noteCorrected();  // what is around the robot comes first again
  progress_.failed = 0;
  progress_.fault.clear();
  countToGo();
}

std::vector<StampedMotion> MapCorrector::trajectory() const {
  std::vector<StampedMotion> poses;
  for (Number n = journal_.begin(); n < journal_.end(); ++n) {
    poses.push_back({journal_.at(n).stamp, journal_.at(n).wanted});
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const StampedMotion& a, const StampedMotion& b) { return a.stamp < b.stamp; });
  return poses;
}

void MapCorrector::mark(JournalScan& scan) const {
  scan.off = scan.isKept() &&
             !(ScanJournal::errorOf(scan) <= std::max(settings_.tolerance, kNoError));  // or not a number
}

void MapCorrector::countToGo() {
  progress_.to_go = 0;
  for (Number n = journal_.begin(); n < journal_.end(); ++n) progress_.to_go += journal_.at(n).off;
}

MapCorrector::Progress MapCorrector::progress() const {
  Progress progress = progress_;
  progress.scans = journal_.size();
  progress.bytes = journal_.bytes();
  progress.forgotten = journal_.forgotten();
  progress.done = progress.to_go == 0 && looks_.areDone() && under_way_.empty();
  progress.done_around = progress.done_around || progress.done;
  return progress;
}

std::vector<GridIndex> MapCorrector::update(const Eigen::Vector3d& robot, bool may_change) {
  std::vector<GridIndex> changed;
  while (auto done = takeDone(may_change)) {
    if (std::holds_alternative<Moving>(done->work)) may_change = false;  // enough for once
    const std::vector<GridIndex> moved = take(*done);
    changed.insert(changed.end(), moved.begin(), moved.end());
  }
  if (unpacked_.size() > kMostUnpacked) packNext();
  try {
    if (!looking_ && looks_.areMade()) {
      const std::vector<GridIndex> looked_at = looks_.putInto(map_.replace_looks);
      changed.insert(changed.end(), looked_at.begin(), looked_at.end());
      if (looks_.areMade() && map_.wake) map_.wake();  // more are left
    }
    while (jobs_.size() < (alone_at_work_ ? 1 : kMostJobs) && startNext(robot, may_change)) continue;
  } catch (const std::exception& error) {
    giveUpLooks(error.what());
  }
  return changed;
}

void MapCorrector::finish(const Eigen::Vector3d& robot) {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    ended_.wait(lock, [this] { return jobs_.empty() || jobs_.back().done; });
  }
  alone_at_work_ = true;
  do {
    update(robot);
  } while (!jobs_.empty() || !progress().done || !unpacked_.empty());
  alone_at_work_ = false;
}

void MapCorrector::start(Job job) {
  job.generation = generation_;
  std::set<Number> under_way = under_way_;
  if (const auto* const moving = std::get_if<Moving>(&job.work)) {
    under_way.insert(moving->numbers.begin(), moving->numbers.end());
  }
  const bool looks = std::holds_alternative<Looking>(job.work),
             packs = std::holds_alternative<Packing>(job.work);
  if (alone_at_work_) perform(job);
  job.begun = job.done = alone_at_work_;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    // Scans that are not packed take much memory.
    const auto next = std::find_if(jobs_.begin(), jobs_.end(), [](const Job& each) { return !each.begun; });
    jobs_.insert(packs ? next : jobs_.end(), std::move(job));
  }
  wake_.notify_all();
  under_way_.swap(under_way);
  looking_ = looking_ || looks;
}

bool MapCorrector::startNext(const Eigen::Vector3d& robot, bool may_look) {
  if (startPacking()) return true;
  const NextMove next = nextMove(robot);
  progress_.done_around = !next.around_left && looks_.areDone(robot, kAround);
  if (looking_) return false;
  if (under_way_.empty()) {
    if (!next.number && progress_.to_go > 0) countToGo();  // some have been forgotten
    const bool none_left = progress_.to_go == 0;
    const double within = none_left ? std::numeric_limits<double>::infinity() : kAround;
    const bool is_time = next.number ? !next.is_around : none_left;
    if (is_time && startLooking(robot, within, may_look)) return true;
  }
  if (!next.number || under_way_.size() >= kMostUnderWay) return false;
  // Once what is around has moved, its looks come first, for which nothing may be under way.
  if (!next.is_around && (next.around_left || looks_.areMade() || looks_.areDue(robot, kAround)))
    return false;
  if (map_.ready && !map_.ready()) return false;
  startMoving(*next.number);
  return true;
}

bool MapCorrector::startPacking() {
  Packing packing;
  while (!unpacked_.empty() && packing.scans.size() < kPackedAtOnce) {
    const Number number = unpacked_.front();
    unpacked_.pop_front();
    if (journal_.has(number)) packing.scans.emplace_back(number, journal_.at(number).scan);
  }
  if (packing.scans.empty()) return false;
  start({std::move(packing)});
  return true;
}

MapCorrector::NextMove MapCorrector::nextMove(const Eigen::Vector3d& robot) const {
  NextMove next;
  double nearest = 0.0;
  const auto distanceTo = [&](const JournalScan& scan) {
    return std::min((scan.wanted.translation() - robot).norm(),
                    (scan.T_map_sensor.translation() - robot).norm());
  };
  for (const Number n : under_way_) {
    if (!journal_.has(n)) continue;
    const JournalScan& scan = journal_.at(n);
    // One that is not off is on its way to where an earlier path had it.
    next.around_left = next.around_left || !scan.off || distanceTo(scan) < scan.reach + kAround;
  }
  if (progress_.to_go == 0) return next;
  for (Number n = journal_.begin(); n < journal_.end(); ++n) {
    const JournalScan& scan = journal_.at(n);
    if (!scan.isPacked() || !scan.off || under_way_.count(n) > 0) continue;
    const double metres = distanceTo(scan);
    const bool is_around = metres < scan.reach + kAround;
    next.around_left = next.around_left || is_around;
    const double distance = std::floor(metres / kEquallyNear);
    if (next.number && (next.is_around == is_around ? distance > nearest : next.is_around)) continue;
    next.number = n;
    next.is_around = is_around;
    nearest = distance;
  }
  return next;
}

void MapCorrector::startMoving(Number newest) {
  Moving moving;
  const JournalScan& first = journal_.at(newest);
  // In a cleared box, the intervals of looks depend on which scans were cleared together.
  const bool alone = alone_ || !journal_.placed(newest).cleared.empty();
  for (Number n = newest; moving.numbers.size() < (alone ? 1 : kMovesAtOnce); --n) {
    const JournalScan& scan = journal_.at(n);
    const bool alike = scan.settings == first.settings && scan.cleared_before == first.cleared_before;
    if (!scan.isPacked() || !scan.off || !alike || under_way_.count(n) > 0) break;
    moving.numbers.push_back(n);
    moving.moves.push_back({journal_.placed(n), scan.wanted});
    if (n == journal_.begin()) break;
  }
  start({std::move(moving)});
}

bool MapCorrector::startLooking(const Eigen::Vector3d& robot, double within, bool may_look) {
  ScanMover* const mover = may_look ? mover_.get() : nullptr;
  std::optional<Looking> looking = looks_.next(robot, within, progress_.to_go == 0, mover);
  if (!looking) return false;
  start({std::move(*looking)});
  return true;
}

void MapCorrector::takeLooks(const Job& job, const Looking& looking) {
  looking_ = false;
  if (job.fault.empty() || job.generation != generation_) return;
  if (job.unreadable) leaveWhereItIs(looking.scans[looking.done].number, job.fault);
  if (job.unreadable) return looks_.restart();
  giveUpLooks(job.fault);
}

void MapCorrector::giveUpLooks(const std::string& fault) {
  progress_.fault = fault;
  journal_.noteForeign(looks_.giveUp());
}

void MapCorrector::leaveWhereItIs(Number number, const std::string& fault) {
  progress_.fault = fault;
  journal_.leave(number);
}

std::vector<GridIndex> MapCorrector::take(Job& job) {
  if (const auto* const packing = std::get_if<Packing>(&job.work)) takePacked(job, *packing);
  if (auto* const moving = std::get_if<Moving>(&job.work)) return takeMoved(job, *moving);
  if (const auto* const looking = std::get_if<Looking>(&job.work)) takeLooks(job, *looking);
  return {};
}

void MapCorrector::takePacked(const Job& job, const Packing& packing) {
  for (std::size_t n = 0; n < packing.scans.size(); ++n) {
    const Number number = packing.scans[n].first;
    if (n < packing.packed.size()) {
      journal_.setPacked(number, packing.packed[n]);
    } else if (journal_.has(number)) {
      leaveWhereItIs(number, job.fault);
    }
  }
}

void MapCorrector::packNext() {
  const Number number = unpacked_.front();
  unpacked_.pop_front();
  if (!journal_.has(number)) return;
  Job job{Packing{{{number, journal_.at(number).scan}}, {}}};
  perform(job);
  take(job);
}

void MapCorrector::giveUp(const Moving& moving, const std::string& fault) {
  alone_ = moving.numbers.size() > 1;
  if (alone_) return;
  JournalScan& scan = journal_.at(moving.numbers.front());
  const Eigen::Isometry3d& to = moving.moves.front().to;
  if (!std::equal(to.data(), to.data() + 16, scan.wanted.data(), sameNumber)) return;  // a later path came
  scan.off = false;
  ++progress_.failed;
  progress_.fault = fault;
}

std::vector<GridIndex> MapCorrector::takeMoved(Job& job, Moving& moving) {
  for (const Number number : moving.numbers) under_way_.erase(number);
  const bool all_known = std::all_of(moving.numbers.begin(), moving.numbers.end(),
                                     [&](Number n) { return journal_.has(n) && journal_.at(n).isKept(); });
  std::vector<GridIndex> changed;
  if (job.generation != generation_ || !all_known) {
    countToGo();
    return changed;  // they are moved again
  }
  if (job.fault.empty()) {
    try {
      changed = map_.add(std::move(moving.moved->difference));
    } catch (const std::exception& error) {
      job.fault = error.what();
    }
  }
  if (!job.fault.empty()) {
    giveUp(moving, job.fault);
    countToGo();
    return changed;
  }
  looks_.noteMoved(moving.numbers, *moving.moved);
  for (std::size_t n = 0; n < moving.numbers.size(); ++n) {
    JournalScan& scan = journal_.at(moving.numbers[n]);
    scan.T_map_sensor = moving.moves[n].to;
    changes_.moved.insert(moving.numbers[n]);
    mark(scan);
    scan.regions = std::move(moving.moved->regions[n]);
  }
  alone_ = false;
  progress_.moved += moving.numbers.size();
  progress_.scan_ms = moving.ms / static_cast<double>(moving.numbers.size());
  countToGo();
  return changed;
}

std::optional<MapCorrector::Job> MapCorrector::takeDone(bool may_move) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (jobs_.empty() || !jobs_.front().done) return std::nullopt;
  const Job& first = jobs_.front();
  const bool moves = first.generation == generation_ && std::holds_alternative<Moving>(first.work);
  if (moves && !may_move) return std::nullopt;
  std::optional<Job> taken = std::move(jobs_.front());
  jobs_.pop_front();
  return taken;
}

void MapCorrector::work() {
  yieldToOtherThreads(&gate_);
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    std::list<Job>::iterator next;
    wake_.wait(lock, [&] {
      next = std::find_if(jobs_.begin(), jobs_.end(), [](const Job& job) { return !job.done; });
      return stop_ || next != jobs_.end();
    });
    if (stop_) return;
    Job& job = *next;  // nobody else touches it before it is done
    job.begun = true;
    lock.unlock();
    perform(job);
    lock.lock();
    job.done = true;
    ended_.notify_all();
    if (map_.wake) map_.wake();
  }
}

void MapCorrector::perform(Job& job) {
  try {
    if (auto* const packing = std::get_if<Packing>(&job.work)) {
      for (const auto& [number, scan] : packing->scans) {
        packing->packed.push_back(std::make_shared<const std::string>(packScan(*scan)));
      }
    } else if (auto* const moving = std::get_if<Moving>(&job.work)) {
      Stopwatch watch;
      moving->moved = mover_->move(moving->moves);
      moving->ms = watch.lap();
    } else if (auto* const looking = std::get_if<Looking>(&job.work)) {
      for (; looking->done < looking->scans.size(); ++looking->done) {
        mover_->addLooks(looking->scans[looking->done], *looking->to);
      }
    }
  } catch (const ScanRefused& refused) {
    job.fault = refused.what();
    job.unreadable = refused.reason() != ScanRefused::Reason::kMemory;
  } catch (const std::runtime_error& error) {
    job.fault = error.what();
    job.unreadable = true;
  } catch (const std::exception& error) {
    job.fault = error.what();
  }
}

}  // namespace bki_mapping
