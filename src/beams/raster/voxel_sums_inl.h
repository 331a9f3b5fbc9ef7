/// @file Sums over beams at single voxels, and the direction bins of voxels. Part of line_kernels_inl.h.
#pragma once

#include <algorithm>
#include <cmath>

#include "beams/beam_cells.h"
#include "beams/raster/beam_weight_inl.h"
#include "beams/raster/line_kernels.h"
#include "beams/split_directions.h"
#include "kernel/vec_kernel_inl.h"

namespace bki_mapping {
namespace {

inline void setUpDirections(const Eigen::Vector3f* beams, std::size_t count, double resolution,
                            const SplitDirectionTargets& to) {
  constexpr std::size_t kMost = 64;
  double ends[3][kMost], inverse[kMost];
  float* const rounded[3] = {to.x, to.y, to.z};
  float* const rest[3] = {to.x_rest, to.y_rest, to.z_rest};
  for (std::size_t begin = 0; begin < count; begin += kMost) {
    const std::size_t some = std::min(count - begin, kMost);
    for (std::size_t n = 0; n < some; ++n) {
      const Eigen::Vector3f& beam = beams[begin + n];
      ends[0][n] = static_cast<double>(beam.x());
      ends[1][n] = static_cast<double>(beam.y());
      ends[2][n] = static_cast<double>(beam.z());
    }
    for (std::size_t n = 0; n < some; ++n) {
      const double square = ends[0][n] * ends[0][n] + ends[1][n] * ends[1][n] + ends[2][n] * ends[2][n];
      inverse[n] = square > 0.0 ? 1.0 / std::sqrt(square) : 0.0;
      to.by_length[begin + n] = static_cast<float>(inverse[n] * resolution);
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t n = 0; n < some; ++n) {
        const double exact = ends[axis][n] * inverse[n];
        rounded[axis][begin + n] = static_cast<float>(exact);
        rest[axis][begin + n] = static_cast<float>(exact - static_cast<double>(static_cast<float>(exact)));
      }
    }
  }
}

inline void findGreater(const float* a, const float* b, int count, float* to) {
  int n = 0;
  for (; n + kLanes <= count; n += kLanes) StoreU(Max(LoadU(a + n), LoadU(b + n)), to + n);
  for (; n < count; ++n) to[n] = a[n] < b[n] ? b[n] : a[n];
}

/// Lanes are beams. With the unit vectors u of a beam and v of the voxel's direction, and e = u - v, the
/// line's distance is |p| |e| sqrt(1 - |e|^2 / 4), and the projection on it |p| (1 - |e|^2 / 2).
template <BeamWeight kWeight>
float sumAtWith(const SplitDirectionArrays& beams, const BeamRange* ranges, std::size_t count,
                const SplitPointDirection& voxel, float reach) {
  const float(&direction)[3] = voxel.direction, (&rest)[3] = voxel.rest;
  const float length = voxel.distance, by_reach = length / reach;
  const float to_kernel = by_reach * by_reach * VecKernel::kScale;
  const VecKernel kernel;
  FloatVec sum = {};
  for (std::size_t r = 0; r < count; ++r) {
    for (std::uint32_t b = ranges[r].first; b < ranges[r].last; b += kLanes) {
      const FloatVec x = (LoadU(beams.x + b) - direction[0]) + (LoadU(beams.x_rest + b) - rest[0]),
                     y = (LoadU(beams.y + b) - direction[1]) + (LoadU(beams.y_rest + b) - rest[1]),
                     z = (LoadU(beams.z + b) - direction[2]) + (LoadU(beams.z_rest + b) - rest[2]);
      const FloatVec e2 = x * x + y * y + z * z;
      const FloatVec rho = (1.0f - 0.5f * e2) * (LoadU(beams.by_length + b) * length);
      const FloatVec value = VecWeight<kWeight>::at(rho - VecWeight<kWeight>::kMiddle) *
                             kernel(VecKernel::squared(e2 * (1.0f - 0.25f * e2), to_kernel));
      const Mask is_beam = Iota() < static_cast<std::int32_t>(ranges[r].last - b);
      sum += IfThenElse(is_beam, value, FloatVec{});
    }
  }
  float total = 0.0f;
  for (int lane = 0; lane < kLanes; ++lane) total += sum[lane];
  return total;
}

/// pseudoAngle in units of columns.
[[gnu::always_inline]] inline FloatVec columnsAt(FloatVec x, FloatVec y) {
  const FloatVec fraction = y / Max(Abs(x) + Abs(y), Set(1e-9f));
  return IfThenElse(x >= 0.0f, 2.0f + fraction, IfThenElse(y >= 0.0f, 4.0f - fraction, -fraction)) *
         static_cast<float>(kBeamColumns / 4);
}
[[gnu::always_inline]] inline FloatVec rowsAt(FloatVec sine) {
  return (sine * 0.5f + 0.5f) * static_cast<float>(kBeamRows);
}
[[gnu::always_inline]] inline IntVec binAt(FloatVec x, int bins) {
  return Max(Min(ConvertTo<IntVec>(x), Set(bins - 1)), IntVec{});
}

/// The direction bins of the voxels of a layer of a block.
inline void findCells(const float* first, std::int32_t* cells, float* distances2) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  for (int v = 0; v < kLayer; v += kLanes) {
    const IntVec n = Iota() + v;
    const FloatVec x = ConvertTo<FloatVec>(n & (kBlockEdge - 1)) + first[0],
                   y = ConvertTo<FloatVec>(n / kBlockEdge) + first[1], z = Set(first[2]);
    const FloatVec square = x * x + y * y + z * z;
    const IntVec row = binAt(rowsAt(z / Sqrt(Max(square, Set(1e-9f)))), kBeamRows),
                 column = binAt(columnsAt(x, y), kBeamColumns);
    StoreU(row * kBeamColumns + column, cells + v);
    StoreU(square, distances2 + v);
  }
}

/// As BeamTable::query, by Equations (8) and (9) of docs/method.md.
inline void findWindows(const float* first, float reach, CellWindows& windows) {
  constexpr float kRoom = 1e-2f;  // of rows and columns, for rounding
  for (int v = 0; v < kBlockEdge * kBlockEdge; v += kLanes) {
    const IntVec n = Iota() + v;
    const FloatVec x = ConvertTo<FloatVec>(n & (kBlockEdge - 1)) + first[0],
                   y = ConvertTo<FloatVec>(n / kBlockEdge) + first[1], z = Set(first[2]);
    const FloatVec flat2 = x * x + y * y, square = flat2 + z * z,
                   radius = 1.00001f * reach + 1e-5f * Sqrt(square);
    const Mask inside = square <= radius * radius, pole = flat2 <= radius * radius;
    const FloatVec by_distance = 1.0f / Sqrt(Max(square, Set(1e-9f))), sine = radius * by_distance,
                   cosine = Sqrt(Max(1.0f - sine * sine, FloatVec{}));
    const FloatVec a = z * by_distance * cosine, b = Sqrt(flat2) * by_distance * sine;
    const FloatVec low = IfThenElse(inside | (pole & (z < 0.0f)), Set(-1.0f), a - b),
                   high = IfThenElse(inside | (pole & (z >= 0.0f)), Set(1.0f), a + b);
    StoreU(binAt(rowsAt(low) - kRoom, kBeamRows), windows.first_row + v);
    StoreU(binAt(rowsAt(high) + kRoom, kBeamRows), windows.last_row + v);
    // Turned by the angle that the reach subtends in azimuth.
    const FloatVec turn = radius / Sqrt(Max(flat2, Set(1e-9f))),
                   keep = Sqrt(Max(1.0f - turn * turn, FloatVec{}));
    StoreU(IfThenElse(pole, IntVec{},
                      binAt(columnsAt(x * keep + y * turn, y * keep - x * turn) - kRoom, kBeamColumns)),
           windows.first_column + v);
    StoreU(IfThenElse(pole, Set(kBeamColumns - 1),
                      binAt(columnsAt(x * keep - y * turn, y * keep + x * turn) + kRoom, kBeamColumns)),
           windows.last_column + v);
  }
}

}  // namespace
}  // namespace bki_mapping
