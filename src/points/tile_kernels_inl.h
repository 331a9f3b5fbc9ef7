/// @file Which cells of a grid hold points. Plain loops over arrays, which compilers turn into vector
/// instructions; included once for each instruction set, by point_kernels_*.cpp.
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
void placeCellOnAxis(const TileGrid& grid, const PointSpan& points, std::size_t count, TilePlaces& places,
                     std::int32_t* unsure) {
  const auto per_metre = static_cast<float>(grid.per_metre);
  const float first = grid.from_home[kAxis], per_edge = 1.0f / static_cast<float>(grid.edge);
  const std::int32_t whole_edge = grid.edge, home = grid.home[kAxis];
  const std::int32_t stride = kAxis == 0 ? 1 : (kAxis == 1 ? whole_edge : whole_edge * whole_edge);
  for (std::size_t i = 0; i < count; ++i) {
    const float cells = points.axes[kAxis][i] * per_metre + first, size = std::abs(cells);
    // Rounding errs by less than 3 * 2^-24 of its terms. From kFar on the margin takes all points.
    constexpr float kFar = 0x1.0p22f, kRounding = 4.0f * 0x1.0p-24f;
    const float quotient = size < kFar ? cells : 0.0f;
    const float margin = kRounding * (size + 2.0f * TileGrid::kMostEdge);
    const std::int32_t floor = floorOf(quotient);
    const float aside = std::abs(quotient - (static_cast<float>(floor) + 0.5f));
    // Half a cell keeps the quotient by the edge away from whole numbers.
    const std::int32_t tile = floorOf((static_cast<float>(floor) + 0.5f) * per_edge);
    places.tile[kAxis][i] = home + tile;
    places.cell[i] = (kAxis == 0 ? 0 : places.cell[i]) + stride * (floor - tile * whole_edge);
    unsure[i] = (kAxis == 0 ? 0 : unsure[i]) | static_cast<std::int32_t>(aside >= 0.5f - margin);
  }
}

void placeCellsOnAxes(const TileGrid& grid, const PointSpan& points, std::size_t count, TilePlaces& places,
                      std::int32_t* unsure) {
  placeCellOnAxis<0>(grid, points, count, places, unsure);
  placeCellOnAxis<1>(grid, points, count, places, unsure);
  placeCellOnAxis<2>(grid, points, count, places, unsure);
}

void placeExactlyWhere(const std::int32_t* unsure, const TileGrid& grid, const PointSpan& points,
                       std::size_t count, TilePlaces& places) {
  std::int32_t any = 0;
  for (std::size_t i = 0; i < count; ++i) any |= unsure[i];
  if (any == 0) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (unsure[i] != 0) grid.placeExactly(points, i, places);
  }
}

void placeCells(const TileGrid& grid, const PointSpan& points, std::size_t count, TilePlaces& places) {
  alignas(64) std::int32_t unsure[kBatch];
  placeCellsOnAxes(grid, points, count, places, unsure);
  placeExactlyWhere(unsure, grid, points, count, places);
}

void placePoints(const TileGrid& grid, const PointSpan& points, std::size_t count, TilePlaces& places) {
  alignas(64) std::int32_t unsure[kBatch];
  placeCellsOnAxes(grid, points, count, places, unsure);
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = grid.origin[axis], per_metre = grid.per_metre, edge = grid.edge;
    for (std::size_t i = 0; i < count; ++i) {
      const double quotient = (origin + static_cast<double>(points.axes[axis][i])) * per_metre;
      places.inside[axis][i] = static_cast<float>(quotient - (places.tile[axis][i] * edge + 0.5));
    }
  }
  placeExactlyWhere(unsure, grid, points, count, places);
}

/// The squared distance from a point to the nearest voxel centre of the block before its own, of its own, and
/// of the block after it, on one axis [voxels^2]. @param c from the first centre of its own, -0.5 to 7.5.
struct AxisDistances {
  float before, home, after;

  [[gnu::always_inline]] explicit AxisDistances(float c) {
    constexpr auto kEdge = static_cast<float>(kBlockEdge);
    const auto rounded = static_cast<float>(static_cast<std::int32_t>(c + 0.5f));
    const float nearest = rounded < kEdge - 1.0f ? rounded : kEdge - 1.0f;
    before = (c + 1.0f) * (c + 1.0f);
    home = (c - nearest) * (c - nearest);
    after = (kEdge - c) * (kEdge - c);
  }
};

void reachBlocks(std::size_t count, float reach, TilePlaces& places) {
  const float reach2 = reach * reach;
  for (std::size_t i = 0; i < count; ++i) {
    const AxisDistances x(places.inside[0][i]), y(places.inside[1][i]), z(places.inside[2][i]);
    const float xs[3] = {x.before, x.home, x.after}, ys[3] = {y.before, y.home, y.after},
                zs[3] = {z.before, z.home, z.after};
    std::int32_t reached = 0;
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) {
        const float room = reach2 - zs[k] - ys[j];
        for (int n = 0; n < 3; ++n) reached |= xs[n] < room ? 1 << (n + 3 * j + 9 * k) : 0;
      }
    }
    places.reached[i] = reached;
  }
}

}  // namespace
}  // namespace bki_mapping
