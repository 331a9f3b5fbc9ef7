#include "journal/corrected_looks.h"

#include <algorithm>
#include <map>
#include <new>
#include <utility>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/map/region.h"
#include "core/stopwatch.h"

namespace bki_mapping {
namespace {

/// Scans that are looked through at once.
constexpr std::size_t kLookedThroughAtOnce = 4;
/// Regions whose looks are made at once: few, so that they need little memory.
constexpr std::size_t kRegionsAtOnce = 256;
/// Rounds after which the calling thread looks through the last scans itself, because more keep coming.
constexpr int kPatience = 5;
/// Time for putting looks into the map, before scans come first [ms].
constexpr double kLooksMs = 3.0;

/// Whether any region is one of those of the looks.
bool anyIn(const LooksByRegion& looks, const std::vector<GridIndex>& regions) {
  return std::any_of(regions.begin(), regions.end(),
                     [&](const GridIndex& region) { return looks.count(region) > 0; });
}

}  // namespace

CorrectedLooks::CorrectedLooks(const MapperConfig& config, const ScanJournal& journal, std::size_t memory)
    : journal_(journal),
      edge_(Region::kEdge * GridGeometry(config.resolution).blockSize()),
      has_looks_(config.rules.enabled && config.rules.latest),
      moved_looks_(memory) {}

void CorrectedLooks::noteAdded(Number scan) {
  if (looks_ && anyIn(*looks_, journal_.at(scan).regions)) to_look_.push_back(scan);
}

void CorrectedLooks::noteMoved(const std::vector<Number>& scans, ScanMover::Moved& moved) {
  if (!has_looks_) return;
  for (const Number scan : scans) {
    restart(journal_.at(scan).regions);
    moved_looks_.drop(scan, journal_.at(scan).regions);
  }
  try {
    moved_looks_.add(std::move(moved.looks), scans, moved.regions);
  } catch (const std::bad_alloc&) {
    moved_looks_.clear();  // scans are looked through again
  }
  moves_before_looks_ -= std::min(moves_before_looks_, scans.size());
  for (const std::vector<GridIndex>& regions : moved.regions) restart(regions);
}

void CorrectedLooks::noteCleared() {
  restart();
  moved_looks_.clear();
}

void CorrectedLooks::noteCorrected() {
  restart();
  moves_before_looks_ = 0;
}

void CorrectedLooks::reset() {
  noteCleared();
  changed_regions_.clear();
}

double CorrectedLooks::distanceTo(const GridIndex& region, const Eigen::Vector3d& robot) const {
  const Eigen::Vector3d low = edge_ * Eigen::Vector3d(region.x, region.y, region.z);
  return Eigen::AlignedBox3d(low, low + Eigen::Vector3d::Constant(edge_)).exteriorDistance(robot);
}

bool CorrectedLooks::areDone(const Eigen::Vector3d& robot, double within) const {
  const auto is_near = [&](const GridIndex& region) { return distanceTo(region, robot) <= within; };
  if (looks_ &&
      std::any_of(looks_->begin(), looks_->end(), [&](const auto& of) { return is_near(of.first); })) {
    return false;
  }
  return std::none_of(changed_regions_.begin(), changed_regions_.end(), is_near);
}

bool CorrectedLooks::begin(const Eigen::Vector3d& robot, double within) {
  std::vector<std::pair<double, GridIndex>> nearest;
  for (const GridIndex& region : changed_regions_) {
    const double distance = distanceTo(region, robot);
    if (distance <= within) nearest.emplace_back(distance, region);
  }
  if (nearest.empty()) return false;
  const std::size_t count = std::min(kRegionsAtOnce, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(count), nearest.end());
  nearest.resize(count);
  looks_ = std::make_shared<LooksByRegion>();
  std::map<GridIndex, std::set<Number>> moved;  // scans whose looks are known already
  for (const auto& [distance, region] : nearest) {
    MovedLooks::OfRegion known = moved_looks_.take(region);
    if (journal_.foreign().count(region) == 0) {
      (*looks_)[region] = std::move(known.looks);
      moved[region] = std::move(known.scans);
    }
    changed_regions_.erase(region);
  }
  rounds_ = 0;
  for (Number n = journal_.begin(); n < journal_.end(); ++n) {
    const std::vector<GridIndex>& regions = journal_.at(n).regions;
    const bool is_missing = std::any_of(regions.begin(), regions.end(), [&](const GridIndex& region) {
      const auto known = moved.find(region);
      return known != moved.end() && known->second.count(n) == 0;
    });
    if (is_missing) to_look_.push_back(n);
  }
  moves_before_looks_ = to_look_.size();
  return true;
}

std::optional<CorrectedLooks::Batch> CorrectedLooks::next(const Eigen::Vector3d& robot, double within,
                                                          bool all_moved, ScanMover* mover) {
  if (areDone()) return std::nullopt;
  const bool is_time = all_moved || moves_before_looks_ == 0;
  if (!looks_ && (!is_time || !begin(robot, within))) return std::nullopt;
  const bool in_memory =
      !to_look_.empty() && journal_.has(to_look_.front()) && journal_.at(to_look_.front()).packed;
  if (in_memory && to_look_.size() <= kLookedThroughAtOnce && ++rounds_ > kPatience && mover != nullptr) {
    lookAtNext(*mover);
    return std::nullopt;
  }
  Batch batch{{}, looks_};
  for (; !to_look_.empty() && batch.scans.size() < kLookedThroughAtOnce; to_look_.pop_front()) {
    if (!journal_.has(to_look_.front()) || !journal_.at(to_look_.front()).isKept()) continue;
    if (!journal_.at(to_look_.front()).isPacked()) break;
    batch.scans.push_back(journal_.placed(to_look_.front()));
  }
  if (batch.scans.empty()) return std::nullopt;
  return batch;
}

void CorrectedLooks::lookAtNext(ScanMover& mover) {
  if (to_look_.empty()) return;
  const Number number = to_look_.front();
  if (journal_.has(number) && journal_.at(number).isKept()) {
    if (!journal_.at(number).isPacked()) return;
    mover.addLooks(journal_.placed(number), *looks_);
  }
  to_look_.pop_front();
}

std::vector<GridIndex> CorrectedLooks::putInto(const Replace& map) {
  std::vector<GridIndex> changed;
  Stopwatch watch;
  for (double ms = 0.0; !looks_->empty() && ms < kLooksMs; ms += watch.lap()) {
    const auto first = looks_->begin();
    if (journal_.foreign().count(first->first) == 0) {
      const std::vector<GridIndex> blocks = map(first->first, first->second);
      changed.insert(changed.end(), blocks.begin(), blocks.end());
    }
    looks_->erase(first);
  }
  if (looks_->empty()) looks_ = nullptr;
  return changed;
}

void CorrectedLooks::restart() {
  if (!looks_) return;
  for (const auto& [region, looks] : *looks_) changed_regions_.insert(region);
  looks_ = nullptr;
  to_look_.clear();
}

void CorrectedLooks::restart(const std::vector<GridIndex>& regions) {
  for (const GridIndex& region : regions) {
    changed_regions_.insert(region);
    if (looks_) looks_->erase(region);
  }
  if (looks_ && looks_->empty()) restart();
}

std::vector<GridIndex> CorrectedLooks::giveUp() {
  std::vector<GridIndex> regions;
  if (!looks_) return regions;
  for (const auto& [region, looks] : *looks_) regions.push_back(region);
  looks_ = nullptr;
  to_look_.clear();
  return regions;
}

}  // namespace bki_mapping
