/// @file Ground truth of the voxels of a simulated drive.
#pragma once

#include <functional>
#include <optional>

#include "bki_mapping/core/grid_geometry.h"
#include "simulation/lidar.h"
#include "simulation/shape_index.h"

namespace bki_mapping::simulation {

/// What is in a voxel.
struct VoxelContent {
  /// The most frequent raw label among the sample points inside of something (ties: the smaller label);
  /// nullopt if all are free.
  std::optional<std::uint32_t> label;
  /// Fraction of the voxel that is inside of something. Each sample point stands for the part of the voxel
  /// around it: the whole part if a shape contains the point, otherwise what of it is under the ground. So
  /// it is exact where there is only ground, in a map that is not tilted.
  double filled = 0.0;
};

/// The ground truth of a scene on the voxel grid of its map. Each voxel is sampled at 4 x 4 x 4 evenly spaced
/// points.
class VoxelTruth {
 public:
  VoxelTruth(Scene scene, const Eigen::Isometry3d& T_world_map, const GridGeometry& geometry);
  /// The ground truth of a drive, whose map frame is the sensor's first frame.
  static VoxelTruth of(const Drive& drive, const GridGeometry& geometry) {
    return {drive.scene(), drive.T_world_sensor(0), geometry};
  }
  const GridGeometry& geometry() const { return geometry_; }

  /// @param time since the start of the drive [s].
  VoxelContent contentAt(const VoxelIndex& voxel, double time) const;

  /// Whether a shape, grown by `margin` on all sides, contains one of the sample points.
  /// @param margin [m]. @param wanted selects shapes by their label.
  bool isNear(const VoxelIndex& voxel, double time, double margin,
              const std::function<bool(std::uint32_t)>& wanted) const;
  /// The same for shapes of any label and for the ground.
  bool isNearAnything(const VoxelIndex& voxel, double time, double margin) const;

 private:
  static constexpr int kPoints = 4;  ///< sample points along the edge of a voxel

  /// Calls visit(sample point in the world frame) until it returns true. @return whether it did.
  template <typename Visit>
  bool anyPoint(const VoxelIndex& voxel, Visit&& visit) const;
  /// Shapes near enough to reach the voxel, grown by `margin`.
  std::vector<Shape> shapesAt(const VoxelIndex& voxel, double time, double margin) const;

  /// Height of a point in the world frame over the ground [m].
  double heightOver(const Eigen::Vector3d& point) const {
    return point.z() - scene_.ground.heightAt(point.x(), point.y());
  }

  Scene scene_;
  ShapeIndex index_;
  GridGeometry geometry_;
  Eigen::Isometry3d T_world_map_;
};

}  // namespace bki_mapping::simulation
