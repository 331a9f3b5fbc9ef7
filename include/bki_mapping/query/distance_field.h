/// @file The distance to the nearest obstacle at every voxel of a region.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/types.h"
#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

/// Which voxels are obstacles.
struct ObstacleRules {
  ClassFilter classes = ClassFilter::all();  ///< occupied voxels of these classes
  bool unknown = false;                      ///< also unknown and occluded voxels
  bool operator==(const ObstacleRules& o) const { return classes == o.classes && unknown == o.unknown; }
};

/// The exact signed Euclidean distance transform of a region. In free voxels, the distance from the voxel's
/// centre to that of the nearest obstacle. In obstacles, the resolution minus the distance to the nearest
/// voxel that is none: 0 in their outermost voxels, and falling with the same slope behind. So no value that
/// is not negative differs from the unsigned transform. Obstacles outside of the region do not count: add to
/// the region the distance up to which you need it.
///
/// Takes 12 bytes a voxel. docs/queries.md has the times.
class DistanceField {
 public:
  /// Most voxels in all, and along each axis.
  static constexpr double kMostVoxels = 1e8, kMostAlongAxis = 16384;

  /// @param box map frame [m]; the region has all voxels that overlap it.
  /// @throws std::invalid_argument if the box is not finite, inside out, or too large, or reaches beyond the
  /// grid.
  DistanceField(const StateMap& states, const Eigen::AlignedBox3d& box, const ObstacleRules& rules = {});

  /// Makes the field one of another box, for instance one that has moved with the robot. Reuses its memory,
  /// so that nothing is allocated unless the box holds more voxels than before: much of a new field's time
  /// goes into memory that the system has to provide.
  /// @throws std::invalid_argument as the constructor; the field is then unchanged.
  void compute(const StateMap& states, const Eigen::AlignedBox3d& box);

  /// Makes the field that of another map of the same grid, equal to the bit to a new one, from a snapshot
  /// that was taken later, for instance. Recomputes the lines of voxels that contain a change: of the
  /// obstacles along y, of the results of that along x, and of those along z.
  /// @param changed the blocks whose evidence may have changed, or that were created or erased; others whose
  /// states depend on it are found. Those outside of the region are ignored. @throws std::invalid_argument if
  /// the resolution differs.
  void update(const StateMap& states, Span<const GridIndex> changed);

  /// The voxel with the smallest coordinates, and the number of voxels along each axis.
  const VoxelIndex& min() const { return min_; }
  const Eigen::Vector3i& size() const { return size_; }
  double resolution() const { return resolution_; }
  const ObstacleRules& rules() const { return rules_; }

  bool contains(const VoxelIndex& voxel) const;
  /// [m]; infinite without an obstacle in the region, minus infinite without anything else.
  /// @param voxel in the region.
  float distance(const VoxelIndex& voxel) const { return distances_[positionOf(voxel)]; }
  /// All distances: x fastest, then y, then z. Valid until compute() or the destructor.
  Span<const float> distances() const { return {distances_.get(), width_ * height_ * layers_}; }

  struct Value {
    float distance;            ///< [m]
    Eigen::Vector3f gradient;  ///< of the distance: away from obstacles, mostly of length 1 [m/m]
  };
  /// Trilinear interpolation between the centres of voxels, and the gradient of just that. If one of the
  /// eight is infinite, so is the distance, and the gradient is 0.
  /// @param point map frame [m]. @return nothing outside of the region, or for a point that is not finite.
  std::optional<Value> interpolate(const Eigen::Vector3d& point) const;

 private:
  std::size_t positionOf(const VoxelIndex& voxel) const {
    const auto x = static_cast<std::size_t>(voxel.x - min_.x), y = static_cast<std::size_t>(voxel.y - min_.y),
               z = static_cast<std::size_t>(voxel.z - min_.z);
    return x + width_ * (y + height_ * z);
  }
  /// The first element of row y of layer z in along_y_ and in_plane_.
  std::size_t rowAt(std::size_t y, std::size_t z) const { return stride_ * (y + height_ * z); }

  struct RowWork;

  /// Calls visit(element of along_y_, whether it is an obstacle) for the voxels of a block in the region.
  /// @param block nullptr if the map does not have it.
  template <typename Visit>
  void forEachVoxel(const BlockStates* block, const BlockIndex& index, Visit&& visit);
  void checkResolution(const StateMap& states) const;
  void markObstacles(const StateMap& states);
  void searchColumns(std::size_t chunk, std::size_t y, RowWork& work);

  double resolution_;
  ObstacleRules rules_;
  VoxelIndex min_;
  Eigen::Vector3i size_;
  std::size_t width_, height_, layers_;  ///< size_
  std::size_t stride_;                   ///< elements from row to row in along_y_ and in_plane_
  std::size_t capacity_ = 0;             ///< elements of each array
  // Arrays, which are left uninitialised, so that the threads that fill them are the first to touch them.
  // Squared distances [voxels^2], positive in free voxels, negative in obstacles:
  std::unique_ptr<std::int32_t[]> along_y_;   ///< within the line along y
  std::unique_ptr<std::int32_t[]> in_plane_;  ///< within the plane of x and y
  std::unique_ptr<float[]> distances_;
};

}  // namespace bki_mapping
