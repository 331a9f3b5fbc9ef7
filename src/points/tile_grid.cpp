#include "points/tile_grid.h"

#include <algorithm>

namespace bki_mapping {

TileGrid::TileGrid(const GridGeometry& cell_grid, const Eigen::Vector3d& sensor, int tile_edge)
    : cells(cell_grid),
      edge(tile_edge),
      origin{sensor.x(), sensor.y(), sensor.z()},
      per_metre(1.0 / cell_grid.resolution()) {
  for (int axis = 0; axis < 3; ++axis) {
    const double quotient = origin[axis] * per_metre;
    origin_tile[axis] = floorToInt(std::clamp(quotient, -kFarthest, kFarthest) / edge);
    origin_in_tile[axis] = static_cast<float>(quotient - static_cast<double>(origin_tile[axis]) * edge);
  }
}

void TileGrid::locateExactly(const PointSpan& points, std::size_t i, TilePositions& positions) const {
  Eigen::Vector3d point;
  const double farthest = kFarthest / per_metre;
  for (int axis = 0; axis < 3; ++axis) {
    point[axis] = std::clamp(origin[axis] + static_cast<double>(points.axes[axis][i]), -farthest, farthest);
  }
  const VoxelIndex index = cells.voxelAt(point);
  const std::int32_t floors[3] = {index.x, index.y, index.z};
  positions.cell[i] = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const std::int32_t tile = floorToInt((floors[axis] + 0.5) / edge);
    positions.tile[axis][i] = tile;
    positions.inside[axis][i] =
        static_cast<float>(point[axis] * per_metre - (static_cast<double>(tile) * edge + 0.5));
    positions.cell[i] = positions.cell[i] * edge + floors[axis] - tile * edge;
  }
}

}  // namespace bki_mapping
