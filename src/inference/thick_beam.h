/// @file Beams of a long kernel, added to all voxels that they reach in a slice; included by trace_loop.h
/// alone.
#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "bki_mapping/inference/group_sums.h"
#include "lane_kernel.h"
#include "lane_weight.h"
#include "lanes.h"
#include "traced_beam.h"

namespace bki_mapping {
namespace {

/// Lanes are voxels side by side, times as many rows as there is room for.
constexpr int kRowLanes = kLanes < 8 ? kLanes : 8, kRowsAtOnce = kLanes / kRowLanes;

struct ThickShape {
  FloatLanes lane, row;

  ThickShape() {
    for (int n = 0; n < kLanes; ++n) {
      lane[n] = static_cast<float>(n % kRowLanes);
      row[n] = static_cast<float>(n / kRowLanes);
    }
  }
};

/// Whole numbers from first to last, none if last is below.
struct Span {
  int first, last;

  Span within(const Span& other) const { return {std::max(first, other.first), std::min(last, other.last)}; }
};

/// Row and lane of a beam in a slice, from the group's first voxel on, and how far it reaches [1 /
/// kTrackVoxel].
struct ThickPlace {
  std::int32_t lane, row, half_lane, half_row;

  /// The voxels between two places.
  Span between(std::int32_t low, std::int32_t high) const {
    return {(low + (kTrackVoxel - 1)) >> kTrackBits, high >> kTrackBits};
  }
  /// The rows that the beam reaches in some slices from this on.
  Span rows(const TracedBeam& beam, int slices) const {
    const std::int32_t other = row + (slices - 1) * beam.step_row;
    return between(std::min(row, other) - half_row, std::max(row, other) + half_row);
  }
  Span lanes(const TracedBeam& beam, int slices) const {
    const std::int32_t other = lane + (slices - 1) * beam.step_lane;
    return between(std::min(lane, other) - half_lane, std::max(lane, other) + half_lane);
  }
  void advance(const TracedBeam& beam, int slices) {
    lane += slices * beam.step_lane;
    row += slices * beam.step_row;
  }
};

/// Those of some rows of voxels that are in blocks that matter, as far as these hold any of the lanes.
/// @param layer as layerOf gives it.
inline Span rowsThatMatter(std::uint32_t layer, const Span& lanes, const Span& rows) {
  constexpr Span kAll = {0, kGroupVoxels - 1};
  constexpr std::uint32_t kEachRow = 0x1111;
  const Span l = lanes.within(kAll), r = rows.within(kAll);
  if (l.first > l.last || r.first > r.last) return {0, -1};
  static_assert(kGroupEdge == 4);
  layer &= kEachRow * (0xfu & (0xfu << l.first / kBlockEdge) & (0xfu >> (3 - l.last / kBlockEdge)));
  layer &= (0xffffu << 4 * (r.first / kBlockEdge)) & (0xffffu >> 4 * (3 - r.last / kBlockEdge));
  if (layer == 0) return {0, -1};
  const int first = __builtin_ctz(layer) / kGroupEdge, last = (31 - __builtin_clz(layer)) / kGroupEdge;
  return r.within({kBlockEdge * first, kBlockEdge * (last + 1) - 1});
}

/// Where a beam is added in the slices of a layer, and its values there.
struct alignas(64) ThickSlices {
  static constexpr int kSize = kLanes < kBlockEdge ? kBlockEdge : kLanes;

  std::int32_t at[kSize];                ///< the first voxel, from the group's first on
  std::int32_t width[kSize];             ///< from the first lane to the last
  float e[kSize], g[kSize], rho[kSize];  ///< at that voxel

  /// @param rows that matter. @param count of rows that are added in each slice, from the first of those that
  /// the beam reaches on.
  [[gnu::always_inline]] ThickSlices(const ThickPlace& place, const TracedBeam& beam, const Span& rows,
                                     int count) {
    constexpr std::int32_t kUp = kTrackVoxel - 1;
    const int last_start = kGroupVoxels + GroupSums::kPad - count;
    constexpr float kStep = 1.0f / kTrackVoxel;
    for (int n = 0; n < kBlockEdge; n += kLanes) {
      const IntLanes slice = countUp() + n;
      const IntLanes lane = place.lane + slice * beam.step_lane, row = place.row + slice * beam.step_row;
      IntLanes first_lane = (lane + (kUp - place.half_lane)) >> kTrackBits,
               last_lane = (lane + place.half_lane) >> kTrackBits,
               first_row = (row + (kUp - place.half_row)) >> kTrackBits;
      first_lane = first_lane > 1 - kRowLanes ? first_lane : IntLanes{} + (1 - kRowLanes);
      last_lane = last_lane < kGroupVoxels - 1 ? last_lane : IntLanes{} + (kGroupVoxels - 1);
      first_row = first_row > rows.first ? first_row : IntLanes{} + rows.first;
      first_row = first_row < last_start ? first_row : IntLanes{} + last_start;
      const FloatLanes l = toFloat((first_lane << kTrackBits) - lane) * kStep,
                       r = toFloat((first_row << kTrackBits) - row) * kStep;
      store(at + n, slice * GroupSums::kSlice + first_row * GroupSums::kRow + first_lane);
      store(width + n, last_lane - first_lane);
      store(e + n, l * beam.e_lane + r * beam.e_row);
      store(g + n, r * beam.g_row);
      store(rho + n, beam.rho + toFloat(slice) * beam.rho_slice + l * beam.rho_lane + r * beam.rho_row);
    }
  }
};

/// Adds a beam in slices of one layer. @param count times kRowsAtOnce rows are added; kCount if that is not
/// 0.
/// @param at the first of the slices.
template <BeamWeight kWeight, int kCount>
[[gnu::always_inline]] inline void addThickSlices(const TracedBeam& beam, const ThickSlices& where,
                                                  int slices, int count, const ThickShape& shape,
                                                  const LaneKernel& kernel, float* at) {
  if constexpr (kCount > 0) count = kCount;
  const FloatLanes e_lanes = shape.lane * beam.e_lane + shape.row * beam.e_row,
                   g_lanes = shape.row * beam.g_row,
                   rho_lanes = shape.lane * beam.rho_lane + shape.row * beam.rho_row;
  for (int n = 0; n < slices; ++n) {
    for (int first = 0; first <= where.width[n]; first += kRowLanes) {
      const auto lane = static_cast<float>(first);
      FloatLanes e = e_lanes + (where.e[n] + lane * beam.e_lane), g = g_lanes + where.g[n],
                 rho = rho_lanes + (where.rho[n] + lane * beam.rho_lane);
      float* to = at + where.at[n] + first;
      for (int m = 0; m < count; ++m) {
        const FloatLanes values = Weight<kWeight>::at(rho) * kernel(e * e + LaneKernel::kShift + g * g);
        for (int r = 0; r < kRowsAtOnce; ++r) addTo(to + r * GroupSums::kRow, part<kRowLanes>(values, r));
        to += kRowsAtOnce * GroupSums::kRow;
        e += kRowsAtOnce * beam.e_row;
        g += kRowsAtOnce * beam.g_row;
        rho += kRowsAtOnce * beam.rho_row;
      }
    }
  }
}

/// Adds a beam in the slices of its pass. @param layers of the box, as layerOf gives them. @param at the
/// group's first voxel.
template <BeamWeight kWeight>
[[gnu::always_inline]] inline void addThick(TracedBeam beam, ThickPlace place, const BeamPass& pass,
                                            const std::uint32_t (&layers)[kGroupEdge],
                                            const ThickShape& shape, const LaneKernel& kernel, float* at) {
  for (int slice = pass.first, slices; slice <= pass.last; slice += slices) {
    const int layer = slice / kBlockEdge;
    slices = std::min(pass.last + 1, (layer + 1) * kBlockEdge) - slice;
    const Span rows = rowsThatMatter(layers[layer], place.lanes(beam, slices), place.rows(beam, slices));
    if (rows.first <= rows.last) {
      const int most = std::min(rows.last - rows.first, 2 * place.half_row >> kTrackBits) + 1;
      const int count = (most + kRowsAtOnce - 1) / kRowsAtOnce;
      const ThickSlices where(place, beam, rows, count * kRowsAtOnce);
      const auto add = [&](auto of) {
        addThickSlices<kWeight, decltype(of)::value>(beam, where, slices, count, shape, kernel,
                                                     at + slice * GroupSums::kSlice);
      };
      switch (count) {
        case 1:
          add(std::integral_constant<int, 1>());
          break;
        case 2:
          add(std::integral_constant<int, 2>());
          break;
        case 3:
          add(std::integral_constant<int, 3>());
          break;
        default:
          add(std::integral_constant<int, 0>());
      }
    }
    place.advance(beam, slices);
    beam.rho += static_cast<float>(slices) * beam.rho_slice;
  }
}

}  // namespace
}  // namespace bki_mapping
