/// @file Which beams pass through a box, and in which slices. Part of line_kernels_inl.h.
#pragma once

#include <algorithm>
#include <cmath>

#include "beams/beam_cells.h"
#include "beams/raster/group_sums.h"

namespace bki_mapping {
namespace {

/// The blocks of a box as sets of bits: bit side + 4 height of a layer across a main axis.
struct BoxBlocks {
  static constexpr int kAll = 0xffff, kEachHeight = 0x1111, kEachSide = 0xf;

  Table8<std::int32_t> layer[kGroupEdge];  ///< by main axis: those that matter
  /// Blocks from n - 1 up, and blocks up to n - 1; n is 0 to 5, so that positions beside the box have an
  /// entry.
  Table8<std::int32_t> side_from, side_to, height_from, height_to;

  explicit BoxBlocks(std::uint64_t blocks) {
    static_assert(kGroupEdge == 4);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < kGroupEdge; ++k) {
        layer[k].values[axis] = static_cast<std::int32_t>(layerOf(blocks, axis, k));
      }
    }
    for (int n = 0; n <= 5; ++n) {
      const int below = std::max(n - 1, 0), above = std::max(4 - n, 0);  // blocks left out
      side_from.values[n] = kEachHeight * (kEachSide & (kEachSide << below));
      height_from.values[n] = kAll & (kAll << 4 * below);
      side_to.values[n] = kEachHeight * (kEachSide >> above);
      height_to.values[n] = kAll >> 4 * above;
    }
  }
};

/// Lanes are beams: finds the slices in which each may reach the box. Lengths are in voxels, from the centre
/// of the box. The result is conservative: slack_ covers rounding, and corners count as inside.
class BoxSearch {
 public:
  explicit BoxSearch(const BeamBox& box) : blocks_(box.blocks), reach_(static_cast<float>(box.reach)) {
    const Eigen::Vector3f centre = box.centre().cast<float>();
    for (int axis = 0; axis < 3; ++axis) {
      main_.values[axis] = centre[axis];
      side_.values[axis] = centre[kSideAxis[axis]];
      height_.values[axis] = centre[kHeightAxis[axis]];
    }
    slack_ = 0.01f + 1e-6f * centre.cwiseAbs().maxCoeff();  // for rounding
  }

  /// Finds the passes of up to kLanes beams. @param[out] to room for kLanes passes.
  /// @return the end of those found.
  BeamPass* find(const LineSetupArrays& beams, BeamRange range, BeamPass* to) const {
    const std::uint32_t b = range.first;
    const IntVec axis = LoadU(beams.axis + b);
    const FloatVec end = LoadU(beams.end + b), centre = TableLookup(main_, axis);
    FloatVec low = Max(Min(FloatVec{}, end) - reach_ - centre, Set(-kHalf)),
             high = Min(Max(FloatVec{}, end) + reach_ - centre, Set(kHalf));
    if (!AnyTrue(low - slack_ <= high + slack_)) return to;  // all end before the box, or run away from it
    const Across side = across(LoadU(beams.slope_side + b), TableLookup(side_, axis), centre),
                 height = across(LoadU(beams.slope_height + b), TableLookup(height_, axis), centre);
    for (const Across* each : {&side, &height}) {
      low = Max(low, (-kHalf - each->reach - each->turned) * each->inverse_slope);
      high = Min(high, (kHalf + each->reach - each->turned) * each->inverse_slope);
    }
    low += kHalf + 1.0f - slack_;  // rounds up
    high += kHalf + slack_;
    IntVec alive = (low < high + 1.0f) & (Iota() < static_cast<std::int32_t>(range.last - b));
    IntVec first = ConvertTo<IntVec>(IfThenElse(alive, low, FloatVec{})),
           last = ConvertTo<IntVec>(IfThenElse(alive, high, FloatVec{}));
    alive &= first <= last;
    if (!AnyTrue(alive)) return to;
    IntVec found = {}, from = {}, until = {};
    for (int k = 0; k < kGroupEdge; ++k) {
      const IntVec here = (first < kBlockEdge * (k + 1)) & (last >= kBlockEdge * k) & alive &
                          ((blocksOf(side, k, blocks_.side_from, blocks_.side_to) &
                            blocksOf(height, k, blocks_.height_from, blocks_.height_to) &
                            TableLookup(blocks_.layer[k], axis)) != 0);
      from = IfThenElse(here & ~found, Set(kBlockEdge * k), from);
      until = IfThenElse(here, Set(kBlockEdge * (k + 1) - 1), until);
      found |= here;
    }
    if (!AnyTrue(found)) return to;
    first = Max(first, from);
    last = Min(last, until);
    const FloatVec shear = LoadU(beams.shear + b);
    turnSheared(shear, side, first, last);
    return emit({Iota() + static_cast<std::int32_t>(b), first, last, slicing(axis, shear)}, found, to);
  }

 private:
  static constexpr auto kHalf = static_cast<float>(BeamBox::kHalf);

  /// As BeamSlicing numbers them.
  static IntVec slicing(IntVec axis, FloatVec shear) {
    static_assert(BeamSlicing{0, 1}.number() == 3 && BeamSlicing{0, -1}.number() == 6);
    return axis + IfThenElse(shear == 0.0f, IntVec{}, IfThenElse(shear > 0.0f, Set(3), Set(6)));
  }
  /// Writes the passes found, all kLanes: one that is not found is overwritten by the next, without a branch.
  /// @param fields of BeamPass, in their order.
  static BeamPass* emit(const IntVec (&fields)[4], IntVec found, BeamPass* to) {
    static_assert(sizeof(BeamPass) == 4 * sizeof(std::int32_t));
    alignas(64) std::int32_t passes[4 * kLanes];
    StoreInterleaved4(fields, passes);
    const IntVec step = found & static_cast<std::int32_t>(sizeof(BeamPass));
    auto* bytes = reinterpret_cast<unsigned char*>(to);
    for (int n = 0; n < kLanes; ++n) {
      __builtin_memcpy(bytes, passes + Interleaved4(n), sizeof(BeamPass));
      bytes += step[n];
    }
    return reinterpret_cast<BeamPass*>(bytes);
  }

  /// How lines run along the side axis, or the height axis.
  struct Across {
    FloatVec slope;
    FloatVec at;             ///< position in the slice through the box's centre
    FloatVec reach;          ///< of the kernel, or more
    FloatVec inverse_slope;  ///< of its magnitude
    FloatVec turned;         ///< `at`, with the axis reversed where the slope is negative
  };
  Across across(FloatVec slope, FloatVec centre, FloatVec main) const {
    const FloatVec at = main * slope - centre, size = Max(Abs(slope), Set(1e-9f));
    return {slope, at, reach_ * (1.0f + 0.5f * slope * slope) + slack_, 1.0f / size,
            IfThenElse(slope < 0.0f, -at, at)};
  }
  /// Converts straight slices to the sheared slices that hold the same reached voxels, for beams in sheared
  /// slices.
  void turnSheared(FloatVec shear, const Across& side, IntVec& first, IntVec& last) const {
    // A column is up to half a voxel along the main axis from the line's position in its sheared slice.
    constexpr float kOffset = 64.0f;  // keeps numbers positive: conversion truncates
    const FloatVec by_voxel = 2.0f + Abs(side.slope);
    const FloatVec slice = shear * (side.at + kHalf) + (2.0f * kHalf + kOffset);  // at the box's centre
    const FloatVec low = (ConvertTo<FloatVec>(first) - (kHalf + 0.5f)) * by_voxel + slice,
                   high = (ConvertTo<FloatVec>(last) - (kHalf - 0.5f)) * by_voxel + slice;
    const Mask straight = shear == 0.0f;
    first = IfThenElse(straight, first,
                       ConvertTo<IntVec>(low + 1.0f - slack_) - static_cast<std::int32_t>(kOffset));
    last = IfThenElse(straight, last, ConvertTo<IntVec>(high + slack_) - static_cast<std::int32_t>(kOffset));
  }
  [[gnu::always_inline]] static IntVec blockAt(FloatVec x) {
    return ConvertTo<IntVec>(Min(Max(x, FloatVec{}), Set(static_cast<float>(kGroupEdge + 1))));
  }
  /// The blocks that beams reach in layer k.
  static IntVec blocksOf(const Across& across, int k, const Table8<std::int32_t>& from,
                         const Table8<std::int32_t>& to) {
    constexpr float kToBlocks = 1.0f / kBlockEdge, kHalfLayer = 0.5f * (kBlockEdge - 1);
    const float middle = static_cast<float>(kBlockEdge * k) + kHalfLayer - kHalf;
    const FloatVec at = (across.at + middle * across.slope + (kHalf + kBlockEdge)) * kToBlocks;
    const FloatVec room = (across.reach + kHalfLayer * Abs(across.slope)) * kToBlocks;
    return TableLookup(from, blockAt(at - room)) & TableLookup(to, blockAt(at + room));
  }

  BoxBlocks blocks_;
  Table8<float> main_, side_, height_;  ///< the box's centre by main axis
  float reach_, slack_;
};

/// Line setups, a cache line each, are prefetched this many passes ahead: those of a scan exceed the caches
/// near the core, and passes skip beams.
constexpr std::size_t kAhead = 8;

/// Ranges are short, and far from each other in memory.
inline void prefetch(const LineSetupArrays& beams, std::uint32_t b) {
  __builtin_prefetch(beams.axis + b);
  __builtin_prefetch(beams.end + b);
  __builtin_prefetch(beams.slope_side + b);
  __builtin_prefetch(beams.slope_height + b);
  __builtin_prefetch(beams.shear + b);
}

/// Finds the passes of beams through a box, in the order of the beams. `sums` has room for all of them
/// (GroupSums::reserve). The kAhead passes after the last may be read; their values are arbitrary.
inline void findPasses(const LineSetupArrays& beams, const BeamRange* ranges, std::size_t count,
                       const BeamBox& box, GroupSums& sums) {
  const BoxSearch search(box);
  static_assert(kLanes <= GroupSums::kPassPadding && kAhead <= GroupSums::kPassPadding);
  BeamPass* to = sums.passes.data();
  for (std::size_t r = 0; r < count; ++r) {
    if (r + 1 < count) prefetch(beams, ranges[r + 1].first);
    for (BeamRange left = ranges[r]; left.first < left.last; left.first += kLanes) {
      to = search.find(beams, left, to);
    }
  }
  sums.pass_count = static_cast<std::size_t>(to - sums.passes.data());
}

}  // namespace
}  // namespace bki_mapping
