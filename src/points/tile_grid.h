/// @file Tiles of cells, and the tiles and cells that contain points, for a batch of points at a time.
#pragma once

#include <cstddef>
#include <cstdint>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// Most points in a batch.
constexpr std::size_t kBatch = 256;

/// Points relative to the sensor in the axes of the map frame [m], as one array for each axis.
struct PointSpan {
  const float* axes[3];
};

/// The tile and the cell of each point of a batch.
struct TilePositions {
  alignas(64) std::int32_t tile[3][kBatch];  ///< index of the tile, by axis
  alignas(
      64) float inside[3][kBatch];  ///< the point, relative to the tile's first cell centre [cells], by axis
  alignas(64) std::int32_t cell[kBatch];  ///< offset of the cell in the tile: x + edge y + edge^2 z

  /// Where tiles are blocks: bit x + 3 y + 9 z is set if the point's kernel reaches a voxel centre of the
  /// neighbour with offset (x - 1, y - 1, z - 1). Only for kernels that reach no farther than the neighbours.
  alignas(64) std::int32_t reached[kBatch];

  GridIndex tileOf(std::size_t i) const { return {tile[0][i], tile[1][i], tile[2][i]}; }
};

/// The cells of the map frame, in cubic tiles of edge^3 cells. Cell (0,0,0) is the first of tile (0,0,0).
struct TileGrid {
  static constexpr int kMostEdge = 32;  ///< [cells]
  /// Coordinates are clamped to this magnitude [cells], so that indices do not overflow.
  static constexpr double kFarthest = 1 << 30;

  /// @param origin of the points, in the map frame [m]. @param edge [cells], 1 to kMostEdge.
  TileGrid(const GridGeometry& cells, const Eigen::Vector3d& origin, int edge);

  /// Finds the tile and the cell of one point with the exact quotients of GridGeometry.
  void locateExactly(const PointSpan& points, std::size_t i, TilePositions& positions) const;

  GridGeometry cells;
  int edge;
  // Copies in plain arrays for the vector loops:
  double origin[3];
  double per_metre;             ///< cells per metre
  std::int32_t origin_tile[3];  ///< index of the tile that contains the origin
  float origin_in_tile[3];      ///< the origin, relative to that tile's lowest corner [cells]
};

}  // namespace bki_mapping
