#include "simulation/voxel_truth.h"

#include <algorithm>
#include <map>
#include <utility>

namespace bki_mapping::simulation {

VoxelTruth::VoxelTruth(Scene scene, const Eigen::Isometry3d& T_world_map, const GridGeometry& geometry)
    : scene_(std::move(scene)), index_(scene_.shapes), geometry_(geometry), T_world_map_(T_world_map) {}

template <typename Visit>
bool VoxelTruth::anyPoint(const VoxelIndex& voxel, Visit&& visit) const {
  const Eigen::Vector3d corner = Eigen::Vector3d(voxel.x, voxel.y, voxel.z);
  for (int i = 0; i < kPoints * kPoints * kPoints; ++i) {
    const Eigen::Vector3d inside(i % kPoints, i / kPoints % kPoints, i / (kPoints * kPoints));
    const Eigen::Vector3d point = corner + (inside + Eigen::Vector3d::Constant(0.5)) / kPoints;
    if (visit(T_world_map_ * (point * geometry_.resolution()))) return true;
  }
  return false;
}

std::vector<Shape> VoxelTruth::shapesAt(const VoxelIndex& voxel, double time, double margin) const {
  const Eigen::Vector3d centre = T_world_map_ * geometry_.voxelCentre(voxel);
  const double reach = 0.87 * geometry_.resolution();  // half the diagonal of a voxel
  std::vector<Shape> shapes;
  for (const std::uint32_t number : index_.near(centre.head<2>(), reach + std::max(0.0, 1.5 * margin))) {
    const Shape& shape = scene_.shapes[number];
    if (!shape.isThereAt(time)) continue;
    Shape grown = shape;
    grown.half.array() += margin;
    const double radius = grown.half.norm() + reach;
    if ((shape.centreAt(time) - centre).squaredNorm() <= radius * radius) shapes.push_back(grown);
  }
  return shapes;
}

VoxelContent VoxelTruth::contentAt(const VoxelIndex& voxel, double time) const {
  const Scene near{scene_.ground, shapesAt(voxel, time, 0.0)};
  const double height = geometry_.resolution() / kPoints;  // of the part of the voxel around a sample point
  std::map<std::uint32_t, int> votes;
  double inside = 0.0;
  anyPoint(voxel, [&](const Eigen::Vector3d& point) {
    if (const auto of_shape = near.shapeLabelAt(point, time)) {
      ++votes[*of_shape];
      inside += 1.0;
      return false;
    }
    const double above = heightOver(point);
    if (above <= 0.0) ++votes[near.ground.labelAt(point.x(), point.y())];
    inside += std::clamp(0.5 - above / height, 0.0, 1.0);
    return false;
  });
  VoxelContent content;
  for (const auto& [label, count] : votes) {
    if (!content.label || count > votes[*content.label]) content.label = label;
  }
  content.filled = inside / (kPoints * kPoints * kPoints);
  return content;
}

bool VoxelTruth::isNear(const VoxelIndex& voxel, double time, double margin,
                        const std::function<bool(std::uint32_t)>& wanted) const {
  for (const Shape& shape : shapesAt(voxel, time, margin)) {
    if (!wanted(shape.label)) continue;
    if (anyPoint(voxel, [&](const Eigen::Vector3d& point) { return shape.contains(point, time); }))
      return true;
  }
  return false;
}

bool VoxelTruth::isNearAnything(const VoxelIndex& voxel, double time, double margin) const {
  return anyPoint(voxel, [&](const Eigen::Vector3d& point) { return heightOver(point) <= margin; }) ||
         isNear(voxel, time, margin, [](std::uint32_t) { return true; });
}

}  // namespace bki_mapping::simulation
