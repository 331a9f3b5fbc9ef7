#include "evaluation/occupancy_evaluation.h"

#include "evaluation/crossed_voxels.h"

namespace bki_mapping {

OccupancyEvaluation::Seen& OccupancyEvaluation::seen(const VoxelIndex& index) {
  const auto fresh = static_cast<std::uint32_t>(voxels_.size());
  const std::uint32_t n = index_of_.insert(index, fresh);
  if (n == fresh) voxels_.push_back({index});
  return voxels_[n];
}

void OccupancyEvaluation::add(const Scan& scan) {
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.origin + scan.points[i].cast<double>();
    if (!geometry_.contains(point)) continue;
    Seen& voxel = seen(geometry_.voxelAt(point));
    const bool moving = !scan.labels_are_ids && moving_.contains(scan.labels[i]);
    (moving ? voxel.moving : voxel.standing) = true;
  }
  forEachCrossedVoxel(scan, geometry_, [this](const VoxelIndex& index) { seen(index); });
}

Reliability OccupancyEvaluation::compare(const Occupants& map,
                                         const std::function<bool(const VoxelIndex&)>& left) const {
  Reliability reliability;
  for (const Seen& voxel : voxels_) {
    const std::optional<double> occupancy = map.occupantOf(voxel.index).occupancy;
    if (!occupancy) continue;
    if (voxel.moving && !voxel.standing && !left(voxel.index)) continue;
    reliability.add(*occupancy, 1, voxel.standing ? 1 : 0);
  }
  return reliability;
}

}  // namespace bki_mapping
