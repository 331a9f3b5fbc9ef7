/// @file The tiles that a box touches.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bki_mapping/map/region.h"

namespace bki_mapping {

constexpr int kTileEdge = Region::kEdge * kBlockEdge;  ///< of a tile [voxels]

/// The first and the last tile that may hold voxels of a box. @param box map frame [m]; may be infinite.
inline std::pair<GridIndex, GridIndex> tilesAbout(const Eigen::AlignedBox3d& box, double resolution) {
  const double edge = kTileEdge * resolution;
  // One tile more on each side because of rounding, but within the range of indices.
  constexpr double kMost = GridGeometry::kMaxCoordinate / kTileEdge + 2.0;
  const auto tile = [&](double metres, int wider) {
    return static_cast<int>(std::clamp(std::floor(metres / edge) + wider, -kMost, kMost));
  };
  const Eigen::Vector3d &low = box.min(), &high = box.max();
  return {{tile(low.x(), -1), tile(low.y(), -1), tile(low.z(), -1)},
          {tile(high.x(), 1), tile(high.y(), 1), tile(high.z(), 1)}};
}

/// The tile that holds a voxel.
inline GridIndex tileOf(const VoxelIndex& voxel) {
  return Region::regionOf(GridGeometry::blockOf(voxel));
}

/// The first and the last tile that hold voxels whose centres lie in a box: no tile more. Nothing if no
/// centre does. @param box map frame [m], faces included; may be infinite, but not NaN.
inline std::optional<std::pair<GridIndex, GridIndex>> tilesHolding(const Eigen::AlignedBox3d& box,
                                                                   const GridGeometry& grid) {
  const double most = GridGeometry::kMaxCoordinate * grid.resolution();
  const auto inGrid = [&](const Eigen::Vector3d& corner) {
    return Eigen::Vector3d(
        corner.cwiseMax(Eigen::Vector3d::Constant(-most)).cwiseMin(Eigen::Vector3d::Constant(most)));
  };
  VoxelIndex low = grid.voxelAt(inGrid(box.min())), high = grid.voxelAt(inGrid(box.max()));
  const Eigen::Vector3d low_centre = grid.voxelCentre(low), high_centre = grid.voxelCentre(high);
  low.x += low_centre.x() < box.min().x();
  low.y += low_centre.y() < box.min().y();
  low.z += low_centre.z() < box.min().z();
  high.x -= high_centre.x() > box.max().x();
  high.y -= high_centre.y() > box.max().y();
  high.z -= high_centre.z() > box.max().z();
  if (low.x > high.x || low.y > high.y || low.z > high.z) return std::nullopt;
  return std::make_pair(tileOf(low), tileOf(high));
}

}  // namespace bki_mapping
