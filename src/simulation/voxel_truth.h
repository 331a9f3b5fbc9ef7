/// @file What is really in the voxels of a simulated drive.
#pragma once

#include <functional>
#include <optional>

#include "bki_mapping/core/grid_geometry.h"
#include "simulation/lidar.h"

namespace bki_mapping::simulation {

/// The ground truth of a scene in the voxels of its map. A voxel is told by 4 x 4 x 4 points spread evenly in
/// it.
class VoxelTruth {
 public:
  VoxelTruth(Scene scene, const Eigen::Isometry3d& T_world_map, const GridGeometry& geometry);
  /// That of a drive, whose map frame is the sensor's at its start.
  static VoxelTruth of(const Drive& drive, const GridGeometry& geometry) {
    return {drive.scene(), drive.T_world_sensor(0), geometry};
  }
  const GridGeometry& geometry() const { return geometry_; }

  /// The raw label of most of the points that are inside of something (ties: the smaller label); none if all
  /// are free. @param time since the start of the drive [s].
  std::optional<std::uint32_t> labelAt(const VoxelIndex& voxel, double time) const;

  /// Whether a shape, grown by `margin` on all sides, reaches one of the points.
  /// @param wanted asked for the label of a shape. @param margin [m].
  bool isNear(const VoxelIndex& voxel, double time, double margin,
              const std::function<bool(std::uint32_t)>& wanted) const;
  /// The same for shapes of any label and for the ground.
  bool isNearAnything(const VoxelIndex& voxel, double time, double margin) const;

 private:
  static constexpr int kPoints = 4;  // a voxel's edge

  /// Calls visit(point in the world frame) until it returns true. @return whether it did.
  template <typename Visit>
  bool anyPoint(const VoxelIndex& voxel, Visit&& visit) const;
  /// The shapes that may reach a voxel, grown by `margin`.
  std::vector<Shape> shapesAt(const VoxelIndex& voxel, double time, double margin) const;

  Scene scene_;
  GridGeometry geometry_;
  Eigen::Isometry3d T_world_map_;
};

}  // namespace bki_mapping::simulation
