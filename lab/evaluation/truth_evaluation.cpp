#include "evaluation/truth_evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bki_mapping/rules/voxel_state.h"
#include "evaluation/crossed_voxels.h"

namespace bki_mapping {
namespace {

/// A voxel is mostly empty if less than this fraction of it is inside of something.
constexpr double kMostlyEmpty = 0.5;
/// A voxel is a ghost if nothing movable was near for kGhostAge [s], sampled every kGhostStep [s].
constexpr double kGhostAge = 0.5, kGhostStep = 0.1;

}  // namespace

double TruthQuality::meanIou(const ClassTable& classes) const {
  double sum = 0.0;
  int count = 0;
  for (const SemanticClass& c : classes.classes()) {
    if (voxels.points(c.id) == 0) continue;
    sum += voxels.iou(c.id);
    ++count;
  }
  return sum / count;
}

double TruthQuality::occupiedIou(const ClassTable& classes) const {
  std::size_t both = 0, truly = 0;
  for (const SemanticClass& c : classes.classes()) {
    truly += voxels.points(c.id);
    both += voxels.points(c.id) - voxels.count(c.id, kFreeClass);
  }
  const std::size_t only_called = voxels.points(kFreeClass) - voxels.count(kFreeClass, kFreeClass);
  return static_cast<double>(both) / static_cast<double>(truly + only_called);
}

TruthEvaluation::Seen& TruthEvaluation::seen(const VoxelIndex& index) {
  const auto fresh = static_cast<std::uint32_t>(voxels_.size());
  const std::uint32_t n = index_of_.insert(index, fresh);
  if (n == fresh) voxels_.push_back({index});
  return voxels_[n];
}

void TruthEvaluation::add(const Scan& scan) {
  origins_.push_back(scan.origin);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d way = scan.points[i].cast<double>();
    if (!geometry_.contains(scan.origin + way)) continue;
    seen(geometry_.voxelAt(scan.origin + way)).hit = true;
  }
  forEachCrossedVoxel(scan, geometry_, [this](const VoxelIndex& index) { seen(index).crossed = true; });
}

std::size_t TruthEvaluation::distanceBin(const VoxelIndex& index) const {
  const Eigen::Vector3d centre = geometry_.voxelCentre(index);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& origin : origins_) nearest = std::min(nearest, (centre - origin).squaredNorm());
  const auto& ends = TruthQuality::kDistances;
  return static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), std::sqrt(nearest)) -
                                  ends.begin());
}

bool TruthEvaluation::isMovable(std::uint32_t raw_label) const {
  const auto id = classes_.classOfRaw(raw_label);
  return id && classes_.find(*id)->dynamic;
}

bool TruthEvaluation::isTaken(const VoxelIndex& index, double time) const {
  return truth_.isNear(index, time, 0.0, [this](std::uint32_t label) { return isMovable(label); });
}

bool TruthEvaluation::isGhost(const VoxelIndex& index, double time) const {
  for (double ago = 0.0; ago < kGhostAge + 0.5 * kGhostStep; ago += kGhostStep) {
    const auto movable = [this](std::uint32_t label) { return isMovable(label); };
    if (truth_.isNear(index, time - ago, geometry_.resolution(), movable)) return false;
  }
  return true;
}

ClassId TruthEvaluation::classOf(const simulation::VoxelContent& content) const {
  return content.label ? classes_.classOfRaw(*content.label).value_or(kFreeClass) : kFreeClass;
}

std::vector<VoxelIndex> TruthEvaluation::ghosts(const SemanticMap& map, const StateRules& rules,
                                                double time) const {
  std::vector<VoxelIndex> ghosts;
  forEachKnownVoxel(map, rules, [&](const VoxelIndex& index, const VoxelView& view) {
    const bool movable = view.state == VoxelState::kOccupied && classes_.find(view.label)->dynamic;
    if (movable && isGhost(index, time)) ghosts.push_back(index);
  });
  return ghosts;
}

void TruthEvaluation::countGhosts(const SemanticMap& map, const StateRules& rules, double time) {
  ghosts_ += ghosts(map, rules, time).size();
  ++moments_;
}

TruthQuality TruthEvaluation::compare(const SemanticMap& map, const StateRules& rules, double time) {
  TruthQuality quality = compare(MapOccupants(map, rules), time);
  quality.ghosts = ghosts(map, rules, time).size();
  quality.mean_ghosts = static_cast<double>(ghosts_) / static_cast<double>(moments_);
  return quality;
}

TruthEvaluation::Known& TruthEvaluation::known(const VoxelIndex& index, double time) {
  if (time != known_at_) {
    known_index_.clear();
    known_.clear();
    known_at_ = time;
  }
  const auto fresh = static_cast<std::uint32_t>(known_.size());
  const std::uint32_t n = known_index_.insert(index, fresh);
  if (n == fresh) {
    known_.push_back({truth_.contentAt(index, time), static_cast<std::uint8_t>(distanceBin(index)), {}});
  }
  return known_[n];
}

TruthQuality TruthEvaluation::compare(const Occupants& map, double time) {
  TruthQuality quality;
  const auto add = [&](Proportion SpaceQuality::*figure, std::size_t bin, bool correct) {
    (quality.all.*figure).add(correct);
    (quality.by_distance[bin].*figure).add(correct);
  };
  for (const Seen& voxel : voxels_) {
    const Known& known_here = known(voxel.index, time);
    const std::size_t bin = known_here.bin;
    const ClassId truth = classOf(known_here.content);
    const Occupant occupant = map.occupantOf(voxel.index);
    quality.voxels.add(truth, occupant.label);
    if (occupant.occupancy) quality.occupancy.add(*occupant.occupancy, 1, truth == kFreeClass ? 0 : 1);
    if (voxel.crossed && truth == kFreeClass) {
      add(&SpaceQuality::free_recall, bin, occupant.state == VoxelState::kFree);
    }
    if (voxel.hit && truth != kFreeClass) {
      add(&SpaceQuality::occupied_recall, bin, occupant.state == VoxelState::kOccupied);
    }
  }
  map.forEachKnown([&](const VoxelIndex& index, const Occupant& occupant) {
    if (occupant.state != VoxelState::kFree && occupant.state != VoxelState::kOccupied) return;
    Known& known_here = known(index, time);
    const std::size_t bin = known_here.bin;
    const simulation::VoxelContent& content = known_here.content;
    const ClassId truth = classOf(content);
    if (occupant.state == VoxelState::kFree) {
      add(&SpaceQuality::free_precision, bin, content.filled < kMostlyEmpty);
      return add(&SpaceQuality::free_empty, bin, !content.label);
    }
    add(&SpaceQuality::occupied_precision, bin, truth != kFreeClass);
    if (!known_here.close) known_here.close = truth_.isNearAnything(index, time, geometry_.resolution());
    add(&SpaceQuality::occupied_near, bin, *known_here.close);
    if (index_of_.find(index) == kNoPosition) quality.voxels.add(truth, occupant.label);
    quality.movable += occupant.label != kFreeClass && classes_.find(occupant.label)->dynamic;
  });
  return quality;
}

}  // namespace bki_mapping
