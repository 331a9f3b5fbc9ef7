/// @file Wide kernels: beams added to all voxels that they reach in straight slices. Part of
/// line_kernels_inl.h.
#pragma once

#include <algorithm>
#include <cstdint>

#include "beams/raster/group_sums.h"
#include "beams/raster/slices_inl.h"
#include "kernel/vec_kernel_inl.h"

namespace bki_mapping {
namespace {

/// The voxels of a vector: kSides columns side by side, and as many rows, one above the other, as fill it.
template <int kSides>
struct WideShape {
  static constexpr int kRows = kLanes / kSides;

  FloatVec side, height;

  WideShape() {
    for (int n = 0; n < kLanes; ++n) {
      side[n] = static_cast<float>(n % kSides);
      height[n] = static_cast<float>(n / kSides);
    }
  }
};

/// Integers from first to last; none if last < first.
struct Span {
  int first, last;

  Span within(const Span& other) const { return {std::max(first, other.first), std::min(last, other.last)}; }
  bool empty() const { return first > last; }
};

/// How far the kernel reaches from the line in a slice, in fixed point.
struct WideReach {
  std::int32_t side, height;

  explicit WideReach(const LineSetup& line)
      : side(toFixedPoint(static_cast<double>(line.half_side))),
        height(toFixedPoint(static_cast<double>(line.half_height))) {}

  /// The voxels that a beam reaches in some slices, along one axis. @param at its position in the first.
  static Span span(std::int32_t at, std::int32_t step, int slices, std::int32_t half) {
    const std::int32_t end = at + (slices - 1) * step;
    return {(std::min(at, end) - half + (kOneVoxel - 1)) >> kPositionBits,
            (std::max(at, end) + half) >> kPositionBits};
  }
};

/// Cuts heights down to the blocks that matter among those that hold any of the sides.
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

/// The vectors of voxels that a beam reaches. They are gathered for all slices before any is added: finding
/// them depends on the beam and branches, adding them is one loop without a branch.
template <BeamWeight kWeight, int kSides>
class WideKernelRaster {
 public:
  using Shape = WideShape<kSides>;

  explicit WideKernelRaster(const VecKernel& kernel) : kernel_(kernel) {}

  /// Gathers the vectors of some slices. @param heights that matter.
  [[gnu::always_inline]] void add(const LineInBox& beam, const WideReach& reach, int first, int slices,
                                  const Span& heights, SliceStrides strides) {
    constexpr std::int32_t kUp = kOneVoxel - 1;
    constexpr float kStep = 1.0f / kOneVoxel;
    const int most = std::min(heights.last - heights.first, 2 * reach.height >> kPositionBits) + 1;
    const int times = (most + Shape::kRows - 1) / Shape::kRows;
    const int last_start = kGroupVoxels + GroupSums::kBeside - times * Shape::kRows;
    const int runs = std::min((2 * reach.side >> kPositionBits) / kSides, kGroupVoxels / kSides) + 1;
    int end = count_;
    for (int n = 0; n < slices; n += kLanes) {
      const int here = std::min(slices - n, kLanes);
      const IntVec slice = Iota() + (first + n - kMiddleSlice);
      const IntVec side = beam.side + slice * beam.line.step_side,
                   height = beam.height + slice * beam.line.step_height;
      IntVec first_side = (side + (kUp - reach.side)) >> kPositionBits,
             first_height = (height + (kUp - reach.height)) >> kPositionBits;
      first_side = Max(first_side, Set(1 - kSides));
      first_height = Max(first_height, Set(heights.first));
      first_height = Min(first_height, Set(last_start));
      const FloatVec h = ConvertTo<FloatVec>((first_height << kPositionBits) - height) * kStep;
      const FloatVec slice_rho =
          beam.rho + ConvertTo<FloatVec>(slice) * beam.line.rho_slice + h * beam.line.rho_height;
      const IntVec slice_at = (slice + kMiddleSlice) * strides.slice + first_height * strides.height;
      for (int run = 0; run < runs; ++run) {
        const IntVec from = Min(first_side, Set(kGroupVoxels));
        const FloatVec s = ConvertTo<FloatVec>((from << kPositionBits) - side) * kStep;
        FloatVec e = s * beam.line.e_side + h * beam.line.e_height, g = h * beam.line.g_height,
                 rho = slice_rho + s * beam.line.rho_side;
        IntVec at = slice_at + from;
        for (int time = 0; time < times; ++time, end += here) {
          StoreU(at, at_ + end);
          StoreU(e, e_ + end);
          StoreU(g, g_ + end);
          StoreU(rho, rho_ + end);
          at += Shape::kRows * strides.height;
          e += Shape::kRows * beam.line.e_height;
          g += Shape::kRows * beam.line.g_height;
          rho += Shape::kRows * beam.line.rho_height;
        }
        first_side += kSides;
      }
    }
    count_ = end;
  }

  /// Adds all that are gathered.
  [[gnu::always_inline]] void addTo(float* sums, const LineInBox& beam, SliceStrides strides) {
    const Shape shape = shape_;  // in registers
    const VecKernel kernel = kernel_;
    const FloatVec e_lanes = shape.side * beam.line.e_side + shape.height * beam.line.e_height,
                   g_lanes = shape.height * beam.line.g_height,
                   rho_lanes = shape.side * beam.line.rho_side + shape.height * beam.line.rho_height;
    const int count = count_;
    for (int n = 0; n < count; ++n) {
      const FloatVec e = e_lanes + e_[n], g = g_lanes + g_[n];
      const FloatVec values = VecWeight<kWeight>::at(rho_lanes + rho_[n]) * kernel(VecKernel::squared(e, g));
      float* const to = sums + at_[n];
      for (int row = 0; row < Shape::kRows; ++row) {
        AddU(ExtractLanes<kSides>(values, row), to + row * strides.height);
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
  const VecKernel kernel_;
  int count_ = 0;
  // The first voxel of each vector, and e, g and rho there.
  alignas(64) std::int32_t at_[kRoom + kLanes];
  alignas(64) float e_[kRoom + kLanes], g_[kRoom + kLanes], rho_[kRoom + kLanes];
};

/// Adds a beam in the slices of its pass. @param layers of the box, as layerOf gives them. @param sums at the
/// group's first voxel.
template <BeamWeight kWeight, int kSides>
[[gnu::always_inline]] inline void addWide(const LineInBox& beam, const WideReach& reach,
                                           const BeamPass& pass, const std::uint32_t (&layers)[kGroupEdge],
                                           WideKernelRaster<kWeight, kSides>& vectors, float* sums,
                                           SliceStrides strides) {
  for (int slice = pass.first, slices; slice <= pass.last; slice += slices) {
    const int layer = slice / kBlockEdge;
    slices = std::min(pass.last + 1, (layer + 1) * kBlockEdge) - slice;
    const int steps = slice - kMiddleSlice;
    const Span heights = heightsThatMatter(
        layers[layer],
        WideReach::span(beam.side + steps * beam.line.step_side, beam.line.step_side, slices, reach.side),
        WideReach::span(beam.height + steps * beam.line.step_height, beam.line.step_height, slices,
                        reach.height));
    if (heights.empty()) continue;
    if (vectors.full()) vectors.addTo(sums, beam, strides);
    vectors.add(beam, reach, slice, slices, heights, strides);
  }
  vectors.addTo(sums, beam, strides);
}

/// The same, without cutting heights down to blocks that matter: for kernels of few voxels it costs more than
/// it saves.
template <BeamWeight kWeight, int kSides>
[[gnu::always_inline]] inline void addWideWhole(const LineInBox& beam, const WideReach& reach,
                                                const BeamPass& pass,
                                                WideKernelRaster<kWeight, kSides>& vectors, float* sums,
                                                SliceStrides strides) {
  constexpr Span kAll = {-GroupSums::kBeside, kGroupVoxels - 1 + GroupSums::kBeside};
  vectors.add(beam, reach, pass.first, pass.last - pass.first + 1, kAll, strides);
  vectors.addTo(sums, beam, strides);
}

}  // namespace
}  // namespace bki_mapping
