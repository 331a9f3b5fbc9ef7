#include "evaluation/dynamics_evaluation.h"

#include <algorithm>

namespace bki_mapping {

void DynamicsEvaluation::add(const Scan& scan, const ClassTable& classes, const Scan& whole) {
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.origin + scan.points[i].cast<double>();
    const auto id = classes.classOf(scan.labels[i], labelValues(scan));
    if (!id || id == classes.unlabelled() || !geometry_.contains(point)) continue;
    const VoxelIndex index = geometry_.voxelAt(point);
    const auto fresh = static_cast<std::uint32_t>(voxels_.size());
    const std::uint32_t n = index_of_.insert(index, fresh);
    if (n == fresh) voxels_.push_back({index});
    Voxel& voxel = voxels_[n];
    const bool moving = !scan.labels_are_ids && moving_.contains(scan.labels[i]);
    const SemanticClass& known = *classes.find(*id);
    voxel.ground_points += !moving && known.ground;
    voxel.standing_points += !moving && known.dynamic;
    voxel.other_points += !moving && !known.ground && !known.dynamic;
    voxel.last_hit = added_;
    if (!moving) {
      countLabel(voxel, scan.labels[i] & 0xffffu);
      continue;
    }
    moving_points_.push_back({n, added_});
    voxel.last_moved = added_;
    if (!voxel.moved || voxel.entered_again) not_entered_.push_back(n);
    voxel.moved = true;
    voxel.seen_again = voxel.entered_again = false;
  }
  findEntered(whole);
  ++added_;
}

void DynamicsEvaluation::countLabel(Voxel& voxel, std::uint32_t label) {
  for (std::uint32_t n = voxel.labels; n != kNone; n = labels_[n].next) {
    if (labels_[n].label != label) continue;
    ++labels_[n].points;
    return;
  }
  labels_.push_back({label, 1, voxel.labels});
  voxel.labels = static_cast<std::uint32_t>(labels_.size() - 1);
}

std::vector<std::uint32_t> DynamicsEvaluation::earlyMovingPoints() const {
  std::vector<std::uint32_t> early(voxels_.size());
  for (const MovingPoint& point : moving_points_) early[point.voxel] += point.scan < scans_ / 2;
  return early;
}

void DynamicsEvaluation::findEntered(const Scan& scan) {
  if (not_entered_.empty()) return;
  beams_.build(scan);
  const double edge = geometry_.resolution();
  const auto isEnteredAgain = [&](std::uint32_t n) {
    Voxel& voxel = voxels_[n];
    if (voxel.last_moved == added_) return false;
    const Eigen::Vector3d centre = geometry_.voxelCentre(voxel.index);
    if (!beams_.anyPasses(centre, edge)) return false;
    voxel.seen_again = true;
    voxel.entered_again = beams_.anyPasses(centre, 0.5 * edge);
    return voxel.entered_again;
  };
  not_entered_.erase(std::remove_if(not_entered_.begin(), not_entered_.end(), isEnteredAgain),
                     not_entered_.end());
}

bool DynamicsEvaluation::hasBeenLeft(const VoxelIndex& index, const Taken& taken) const {
  const std::uint32_t n = index_of_.find(index);
  return n == kNoPosition ? !(taken && taken(index)) : !mayBeOccupied(voxels_[n], taken);
}

bool DynamicsEvaluation::isStillThere(const VoxelIndex& index, const Taken& taken) const {
  if (taken) return taken(index);
  const std::uint32_t n = index_of_.find(index);
  return n != kNoPosition && voxels_[n].moved && voxels_[n].last_moved + 1 == added_;
}

std::vector<std::pair<VoxelIndex, VoxelFate>> DynamicsEvaluation::fates(Occupants& map,
                                                                        const Taken& taken) const {
  const std::vector<std::uint32_t> early_moving_points = earlyMovingPoints();
  std::vector<std::pair<VoxelIndex, VoxelFate>> fates;
  for (std::size_t n = 0; n < voxels_.size(); ++n) {
    const Voxel& voxel = voxels_[n];
    const bool occupied = map.at(voxel.index).has_value();
    if (voxel.isShared()) {
      fates.emplace_back(voxel.index, occupied ? VoxelFate::kKept : VoxelFate::kLost);
    } else if (early_moving_points[n] > 0 && !mayBeOccupied(voxel, taken)) {
      fates.emplace_back(voxel.index, occupied ? VoxelFate::kLeft : VoxelFate::kForgotten);
    }
  }
  return fates;
}

DynamicsQuality DynamicsEvaluation::compare(Occupants& map, const Taken& taken) const {
  const std::vector<std::uint32_t> early_moving_points = earlyMovingPoints();
  DynamicsQuality quality;
  for (std::size_t n = 0; n < voxels_.size(); ++n) {
    const Voxel& voxel = voxels_[n];
    const std::uint32_t moving = early_moving_points[n];
    const bool occupied = map.at(voxel.index).has_value();
    quality.ground_points += voxel.ground_points;
    quality.standing_points += voxel.standing_points;
    quality.other_points += voxel.other_points;
    for (std::uint32_t l = voxel.labels; l != kNone; l = labels_[l].next) {
      KeptPoints& of_label = quality.by_label[labels_[l].label];
      of_label.points += labels_[l].points;
      if (occupied) of_label.kept += labels_[l].points;
    }
    quality.floor_voxels += voxel.ground_points > 0;
    if (occupied) {
      quality.ground_kept += voxel.ground_points;
      quality.standing_kept += voxel.standing_points;
      quality.other_kept += voxel.other_points;
    } else if (voxel.ground_points > 0) {
      const VoxelIndex& at = voxel.index;
      ++quality.floor_holes;
      quality.floor_open_holes += !map.at({at.x, at.y, at.z + 1}) && !map.at({at.x, at.y, at.z - 1});
    }
    if (moving == 0 || mayBeOccupied(voxel, taken)) continue;
    quality.moving_points += moving;
    if (!occupied) quality.moving_removed += moving;
    if (voxel.isShared() || !voxel.seen_again) {
      (voxel.isShared() ? quality.moving_shared : quality.moving_unseen) += moving;
      continue;
    }
    quality.decidable_points += moving;
    if (!occupied) quality.decidable_removed += moving;
    if (!voxel.entered_again) continue;
    quality.entered_points += moving;
    if (!occupied) quality.entered_removed += moving;
  }
  quality.static_points = quality.ground_points + quality.standing_points + quality.other_points;
  quality.static_kept = quality.ground_kept + quality.standing_kept + quality.other_kept;
  return quality;
}

}  // namespace bki_mapping
