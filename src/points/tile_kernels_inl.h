/// @file Which cells of a grid hold points. Plain loops over arrays, which compilers turn into vector
/// instructions; included once for each instruction set, with point_kernels_inl.h.
#pragma once

#include <cmath>

#include "points/tile_grid.h"

namespace bki_mapping {
namespace {

/// x must be in the range of an int.
[[gnu::always_inline]] inline std::int32_t floorOf(float x) {
  const auto whole = static_cast<std::int32_t>(x);
  return whole - static_cast<std::int32_t>(static_cast<float>(whole) > x);
}

/// Cells and tiles on one axis, in single precision. @param[in,out] unsure set where rounding may have moved
/// a point across a face.
template <int kAxis>
void locateCellOnAxis(const TileGrid& grid, const PointSpan& points, std::size_t count,
                      TilePositions& positions, std::int32_t* unsure) {
  const auto per_metre = static_cast<float>(grid.per_metre);
  const float first = grid.origin_in_tile[kAxis], per_edge = 1.0f / static_cast<float>(grid.edge);
  const std::int32_t whole_edge = grid.edge, origin_tile = grid.origin_tile[kAxis];
  const std::int32_t stride = kAxis == 0 ? 1 : (kAxis == 1 ? whole_edge : whole_edge * whole_edge);
  for (std::size_t i = 0; i < count; ++i) {
    const float cells = points.axes[kAxis][i] * per_metre + first, size = std::abs(cells);
    // Rounding errs by less than 3 * 2^-24 of its terms. From kFar on, the margin includes all points.
    constexpr float kFar = 0x1.0p22f, kRounding = 4.0f * 0x1.0p-24f;
    const float quotient = size < kFar ? cells : 0.0f;
    const float margin = kRounding * (size + 2.0f * TileGrid::kMostEdge);
    const std::int32_t floor = floorOf(quotient);
    const float aside = std::abs(quotient - (static_cast<float>(floor) + 0.5f));
    // Half a cell keeps the quotient by the edge away from whole numbers.
    const std::int32_t tile = floorOf((static_cast<float>(floor) + 0.5f) * per_edge);
    positions.tile[kAxis][i] = origin_tile + tile;
    positions.cell[i] = (kAxis == 0 ? 0 : positions.cell[i]) + stride * (floor - tile * whole_edge);
    unsure[i] = (kAxis == 0 ? 0 : unsure[i]) | static_cast<std::int32_t>(aside >= 0.5f - margin);
  }
}

void locateCellsOnAxes(const TileGrid& grid, const PointSpan& points, std::size_t count,
                       TilePositions& positions, std::int32_t* unsure) {
  locateCellOnAxis<0>(grid, points, count, positions, unsure);
  locateCellOnAxis<1>(grid, points, count, positions, unsure);
  locateCellOnAxis<2>(grid, points, count, positions, unsure);
}

void locateExactlyWhere(const std::int32_t* unsure, const TileGrid& grid, const PointSpan& points,
                        std::size_t count, TilePositions& positions) {
  std::int32_t any = 0;
  for (std::size_t i = 0; i < count; ++i) any |= unsure[i];
  if (any == 0) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (unsure[i] != 0) grid.locateExactly(points, i, positions);
  }
}

void locateCells(const TileGrid& grid, const PointSpan& points, std::size_t count, TilePositions& positions) {
  alignas(64) std::int32_t unsure[kBatch];
  locateCellsOnAxes(grid, points, count, positions, unsure);
  locateExactlyWhere(unsure, grid, points, count, positions);
}

void locatePoints(const TileGrid& grid, const PointSpan& points, std::size_t count,
                  TilePositions& positions) {
  alignas(64) std::int32_t unsure[kBatch];
  locateCellsOnAxes(grid, points, count, positions, unsure);
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = grid.origin[axis], per_metre = grid.per_metre, edge = grid.edge;
    for (std::size_t i = 0; i < count; ++i) {
      const double quotient = (origin + static_cast<double>(points.axes[axis][i])) * per_metre;
      positions.inside[axis][i] = static_cast<float>(quotient - (positions.tile[axis][i] * edge + 0.5));
    }
  }
  locateExactlyWhere(unsure, grid, points, count, positions);
}

/// The squared distances, on one axis, from a point to the nearest voxel centres of its containing block and
/// of the blocks before and after it [voxels^2]. @param c from the first centre of the containing block, -0.5
/// to 7.5.
struct AxisDistances {
  float before, containing, after;

  [[gnu::always_inline]] explicit AxisDistances(float c) {
    constexpr auto kEdge = static_cast<float>(kBlockEdge);
    const auto rounded = static_cast<float>(static_cast<std::int32_t>(c + 0.5f));
    const float nearest = rounded < kEdge - 1.0f ? rounded : kEdge - 1.0f;
    before = (c + 1.0f) * (c + 1.0f);
    containing = (c - nearest) * (c - nearest);
    after = (kEdge - c) * (kEdge - c);
  }
};

void reachBlocks(std::size_t count, float reach, TilePositions& positions) {
  const float reach2 = reach * reach;
  for (std::size_t i = 0; i < count; ++i) {
    const AxisDistances x(positions.inside[0][i]), y(positions.inside[1][i]), z(positions.inside[2][i]);
    const float xs[3] = {x.before, x.containing, x.after}, ys[3] = {y.before, y.containing, y.after},
                zs[3] = {z.before, z.containing, z.after};
    std::int32_t reached = 0;
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) {
        const float room = reach2 - zs[k] - ys[j];
        for (int n = 0; n < 3; ++n) reached |= xs[n] < room ? 1 << (n + 3 * j + 9 * k) : 0;
      }
    }
    positions.reached[i] = reached;
  }
}

}  // namespace
}  // namespace bki_mapping
