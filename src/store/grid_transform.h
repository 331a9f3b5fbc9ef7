/// @file Moves voxels from one grid to another.
#pragma once

#include <Eigen/Geometry>
#include <utility>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/store/map_merge.h"

namespace bki_mapping {

/// The tiles from `low` to `high`, both included.
struct TileRange {
  GridIndex low, high;
};

/// Maps the voxels of one grid to those of another with the same resolution.
///
/// Voxel (0, 0, 0) spans 0 to 1 on each axis, so that quarter turns about the origin map voxels to voxels:
/// centre (x + 1/2, y + 1/2) goes to (-y - 1/2, x + 1/2), the centre of voxel (-y - 1, x).
class GridTransform {
 public:
  /// @throws std::invalid_argument if the placement is not finite.
  GridTransform(const MapPlacement& placement, double resolution);

  /// Whether the transform maps whole voxels to whole voxels, one to one.
  bool exact() const { return exact_; }
  bool identity() const { return exact_ && cos_ == 1.0 && shift_.isZero(0.0); }

  /// The voxel of the source map from which a voxel of the target map takes its evidence.
  VoxelIndex sourceOf(const VoxelIndex& target) const;
  /// Tiles that contain the sources of all voxels of a target tile.
  TileRange sourceTiles(const GridIndex& target) const;
  /// Tiles that contain all voxels whose sources lie in a source tile.
  /// @throws std::invalid_argument if they are beyond GridGeometry::kMaxCoordinate.
  TileRange targetTiles(const GridIndex& source) const;
  /// The bounding box of a box after the transform [m]. If the transform is exact, corners of voxels go to
  /// corners of voxels, to the bit.
  Eigen::AlignedBox3d apply(const Eigen::AlignedBox3d& box) const;

 private:
  Eigen::Vector3d forward(const Eigen::Vector3d& point) const;   ///< [voxels]
  Eigen::Vector3d backward(const Eigen::Vector3d& point) const;  ///< [voxels]

  double resolution_;
  double cos_ = 1.0, sin_ = 0.0;
  Eigen::Vector3d shift_;  ///< [voxels]
  bool exact_;
};

}  // namespace bki_mapping
