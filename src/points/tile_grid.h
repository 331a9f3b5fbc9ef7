/// @file Where points lie in a grid of cells, many points at a time.
#pragma once

#include <cstddef>
#include <cstdint>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// At most so many points are placed at a time.
constexpr std::size_t kBatch = 256;

/// Points relative to the sensor, axes of the map frame [m]; axis by axis.
struct PointSpan {
  const float* axes[3];
};

/// The places of a batch of points.
struct TilePlaces {
  alignas(64) std::int32_t tile[3][kBatch];  ///< the tile's index, axis by axis
  alignas(64) float inside[3][kBatch];       ///< from its first cell's centre [cells], axis by axis
  alignas(64) std::int32_t cell[kBatch];     ///< in the tile: x + edge y + edge^2 z

  /// Bit x + 3 y + 9 z: the point reaches a voxel centre of the tile that is (x, y, z) - 1 away, the tile
  /// being a block. Only for kernels that reach no farther.
  alignas(64) std::int32_t reached[kBatch];

  GridIndex tileOf(std::size_t i) const { return {tile[0][i], tile[1][i], tile[2][i]}; }
};

/// Cells of the map frame, in cubic tiles of edge x edge x edge cells. Tile (0,0,0) begins at cell (0,0,0).
struct TileGrid {
  static constexpr int kMostEdge = 32;  ///< cells
  /// Points farther from the map's origin than this [cells] are placed there: indices must stay within their
  /// type.
  static constexpr double kFarthest = 1 << 30;

  /// @param origin of the points, in the map frame [m]. @param edge [cells], 1 to kMostEdge.
  TileGrid(const GridGeometry& cells, const Eigen::Vector3d& origin, int edge);

  /// Finds the place of one point, with the exact quotients of GridGeometry.
  void placeExactly(const PointSpan& points, std::size_t i, TilePlaces& places) const;

  GridGeometry cells;
  int edge;
  // The same in plain numbers, for the inner loops.
  double origin[3];
  double per_metre;      ///< cells
  std::int32_t home[3];  ///< the tile in which the origin is
  float from_home[3];    ///< of the origin, from that tile's first cell's face [cells]
};

}  // namespace bki_mapping
