/// @file Beams of a long kernel, added to all voxels that they reach in straight slices; included by
/// trace_loop.h alone.
#pragma once

#include <algorithm>
#include <cstdint>

#include "beams/raster/group_sums.h"
#include "beams/raster/lane_weight.h"
#include "beams/raster/traced_beam.h"
#include "kernel/lane_kernel.h"
#include "simd/lanes.h"

namespace bki_mapping {
namespace {

/// Lanes are kSides voxels side by side, times as many rows, one above the other, as there is room for.
template <int kSides>
struct ThickShape {
  static constexpr int kRows = kLanes / kSides;

  FloatLanes side, height;

  ThickShape() {
    for (int n = 0; n < kLanes; ++n) {
      side[n] = static_cast<float>(n % kSides);
      height[n] = static_cast<float>(n / kSides);
    }
  }
};

/// Whole numbers from first to last, none if last is below.
struct Span {
  int first, last;

  Span within(const Span& other) const { return {std::max(first, other.first), std::min(last, other.last)}; }
  bool empty() const { return first > last; }
};

/// How far a beam reaches from its place in a slice [1 / kTrackVoxel].
struct ThickReach {
  std::int32_t side, height;

  explicit ThickReach(const BeamTrack& track)
      : side(TracedBeam::place(static_cast<double>(track.half_side))),
        height(TracedBeam::place(static_cast<double>(track.half_height))) {}

  /// The voxels that a beam reaches in some slices, along one axis. @param place in the first.
  static Span span(std::int32_t place, std::int32_t step, int slices, std::int32_t half) {
    const std::int32_t other = place + (slices - 1) * step;
    return {(std::min(place, other) - half + (kTrackVoxel - 1)) >> kTrackBits,
            (std::max(place, other) + half) >> kTrackBits};
  }
};

/// Those of some heights that are in blocks that matter, as far as these hold any of the sides.
/// @param layer as layerOf gives it.
inline Span heightsThatMatter(std::uint32_t layer, const Span& sides, const Span& heights) {
  constexpr Span kAll = {0, kGroupVoxels - 1};
  constexpr std::uint32_t kEachHeight = 0x1111;
  static_assert(kGroupEdge == 4);
  const Span s = sides.within(kAll), h = heights.within(kAll);
  if (s.empty() || h.empty()) return {0, -1};
  layer &= kEachHeight * (0xfu & (0xfu << s.first / kBlockEdge) & (0xfu >> (3 - s.last / kBlockEdge)));
  layer &= (0xffffu << 4 * (h.first / kBlockEdge)) & (0xffffu >> 4 * (3 - h.last / kBlockEdge));
  if (layer == 0) return {0, -1};
  const int first = __builtin_ctz(layer) / kGroupEdge, last = (31 - __builtin_clz(layer)) / kGroupEdge;
  return h.within({kBlockEdge * first, kBlockEdge * (last + 1) - 1});
}

/// What is to be added for a beam, so many lanes after so many.
template <BeamWeight kWeight, int kSides>
class ThickVectors {
 public:
  using Shape = ThickShape<kSides>;

  explicit ThickVectors(const LaneKernel& kernel) : kernel_(kernel) {}

  /// Takes slices from `first` on. @param heights that matter.
  [[gnu::always_inline]] void add(const TracedBeam& beam, const ThickReach& reach, int first, int slices,
                                  const Span& heights, SliceStrides strides) {
    constexpr std::int32_t kUp = kTrackVoxel - 1;
    constexpr float kStep = 1.0f / kTrackVoxel;
    const int most = std::min(heights.last - heights.first, 2 * reach.height >> kTrackBits) + 1;
    const int times = (most + Shape::kRows - 1) / Shape::kRows;
    const int last_start = kGroupVoxels + GroupSums::kBeside - times * Shape::kRows;
    const int runs = std::min((2 * reach.side >> kTrackBits) / kSides, kGroupVoxels / kSides) + 1;
    int end = count_;
    for (int n = 0; n < slices; n += kLanes) {
      const int here = std::min(slices - n, kLanes);
      const IntLanes slice = countUp() + (first + n - kMiddleSlice);
      const IntLanes side = beam.side + slice * beam.track.step_side,
                     height = beam.height + slice * beam.track.step_height;
      IntLanes first_side = (side + (kUp - reach.side)) >> kTrackBits,
               first_height = (height + (kUp - reach.height)) >> kTrackBits;
      first_side = first_side > 1 - kSides ? first_side : IntLanes{} + (1 - kSides);
      first_height = first_height > heights.first ? first_height : IntLanes{} + heights.first;
      first_height = first_height < last_start ? first_height : IntLanes{} + last_start;
      const FloatLanes h = toFloat((first_height << kTrackBits) - height) * kStep;
      const FloatLanes slice_rho =
          beam.rho + toFloat(slice) * beam.track.rho_slice + h * beam.track.rho_height;
      const IntLanes slice_at = (slice + kMiddleSlice) * strides.slice + first_height * strides.height;
      for (int run = 0; run < runs; ++run) {
        const IntLanes from = first_side < kGroupVoxels ? first_side : IntLanes{} + kGroupVoxels;
        const FloatLanes s = toFloat((from << kTrackBits) - side) * kStep;
        FloatLanes e = s * beam.track.e_side + h * beam.track.e_height, g = h * beam.track.g_height,
                   rho = slice_rho + s * beam.track.rho_side;
        IntLanes at = slice_at + from;
        for (int time = 0; time < times; ++time, end += here) {
          store(at_ + end, at);
          store(e_ + end, e);
          store(g_ + end, g);
          store(rho_ + end, rho);
          at += Shape::kRows * strides.height;
          e += Shape::kRows * beam.track.e_height;
          g += Shape::kRows * beam.track.g_height;
          rho += Shape::kRows * beam.track.rho_height;
        }
        first_side += kSides;
      }
    }
    count_ = end;
  }

  /// Adds them all.
  [[gnu::always_inline]] void addTo(float* sums, const TracedBeam& beam, SliceStrides strides) {
    const Shape shape = shape_;  // in registers, as the kernel
    const LaneKernel kernel = kernel_;
    const FloatLanes e_lanes = shape.side * beam.track.e_side + shape.height * beam.track.e_height,
                     g_lanes = shape.height * beam.track.g_height,
                     rho_lanes = shape.side * beam.track.rho_side + shape.height * beam.track.rho_height;
    const int count = count_;
    for (int n = 0; n < count; ++n) {
      const FloatLanes e = e_lanes + e_[n], g = g_lanes + g_[n];
      const FloatLanes values =
          Weight<kWeight>::at(rho_lanes + rho_[n]) * kernel(e * e + LaneKernel::kShift + g * g);
      float* const to = sums + at_[n];
      for (int row = 0; row < Shape::kRows; ++row) {
        bki_mapping::addTo(to + row * strides.height, part<kSides>(values, row));
      }
    }
    count_ = 0;
  }

  /// Whether there may be no room for more.
  bool full() const { return count_ + kMostAtOnce > kRoom; }

 private:
  static constexpr int kMostAtOnce =
      kBlockEdge * (kGroupVoxels / Shape::kRows + 1) * (kGroupVoxels / kSides + 1);
  static constexpr int kRoom = 512 + kMostAtOnce;

  const Shape shape_;
  const LaneKernel kernel_;
  int count_ = 0;
  // The first voxel, and e, g and rho there.
  alignas(64) std::int32_t at_[kRoom + kLanes];
  alignas(64) float e_[kRoom + kLanes], g_[kRoom + kLanes], rho_[kRoom + kLanes];
};

/// Adds a beam in the slices of its pass. @param layers of the box, as layerOf gives them. @param sums at the
/// group's first voxel.
template <BeamWeight kWeight, int kSides>
[[gnu::always_inline]] inline void addThick(const TracedBeam& beam, const ThickReach& reach,
                                            const BeamPass& pass, const std::uint32_t (&layers)[kGroupEdge],
                                            ThickVectors<kWeight, kSides>& vectors, float* sums,
                                            SliceStrides strides) {
  for (int slice = pass.first, slices; slice <= pass.last; slice += slices) {
    const int layer = slice / kBlockEdge;
    slices = std::min(pass.last + 1, (layer + 1) * kBlockEdge) - slice;
    const int steps = slice - kMiddleSlice;
    const Span heights = heightsThatMatter(
        layers[layer],
        ThickReach::span(beam.side + steps * beam.track.step_side, beam.track.step_side, slices, reach.side),
        ThickReach::span(beam.height + steps * beam.track.step_height, beam.track.step_height, slices,
                         reach.height));
    if (heights.empty()) continue;
    if (vectors.full()) vectors.addTo(sums, beam, strides);
    vectors.add(beam, reach, slice, slices, heights, strides);
  }
  vectors.addTo(sums, beam, strides);
}

/// The same where the kernel is so short that leaving out heights does not pay.
template <BeamWeight kWeight, int kSides>
[[gnu::always_inline]] inline void addThickWhole(const TracedBeam& beam, const ThickReach& reach,
                                                 const BeamPass& pass, ThickVectors<kWeight, kSides>& vectors,
                                                 float* sums, SliceStrides strides) {
  constexpr Span kAll = {-GroupSums::kBeside, kGroupVoxels - 1 + GroupSums::kBeside};
  vectors.add(beam, reach, pass.first, pass.last - pass.first + 1, kAll, strides);
  vectors.addTo(sums, beam, strides);
}

}  // namespace
}  // namespace bki_mapping
