/// @file The tiles that a box touches.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
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

}  // namespace bki_mapping
