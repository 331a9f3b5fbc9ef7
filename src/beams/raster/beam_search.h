/// @file Which beams pass through a box; included by the inner loops alone.
#pragma once

#include <algorithm>
#include <cmath>

#include "beams/beam_cells.h"
#include "beams/raster/group_sums.h"
#include "simd/lanes.h"

namespace bki_mapping {
namespace {

/// The blocks of a box as sets of bits: those of a layer across a main axis, side first.
struct BoxBlocks {
  static constexpr int kAll = 0xffff, kEachHeight = 0x1111, kEachSide = 0xf;

  Table<std::int32_t> layer[kGroupEdge];  ///< by main axis: those that matter
  /// Those with number n - 1 and more, and those with up to n - 1, n being 0 to 5.
  Table<std::int32_t> side_from, side_to, height_from, height_to;

  explicit BoxBlocks(std::uint64_t blocks) {
    static_assert(kGroupEdge == 4);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < kGroupEdge; ++k) {
        layer[k].values[axis] = static_cast<std::int32_t>(layerOf(blocks, axis, k));
      }
    }
    for (int n = 0; n <= 5; ++n) {
      const int below = std::max(n - 1, 0), above = std::max(4 - n, 0);  // how many are left out
      side_from.values[n] = kEachHeight * (kEachSide & (kEachSide << below));
      height_from.values[n] = kAll & (kAll << 4 * below);
      side_to.values[n] = kEachHeight * (kEachSide >> above);
      height_to.values[n] = kAll >> 4 * above;
    }
  }
};

/// Beams side by side, and the slices in which they may reach the box. Lengths are in voxels, from the box's
/// centre.
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

  /// Finds the passes of up to kLanes beams. @param[out] to the passes; as many are written to.
  /// @return behind the last pass found.
  BeamPass* find(const BeamTrackArrays& beams, BeamRange range, BeamPass* to) const {
    const std::uint32_t b = range.first;
    const IntLanes axis = load(beams.axis + b);
    const FloatLanes end = load(beams.end + b), centre = main_[axis];
    FloatLanes low = greater(lesser(FloatLanes{}, end) - reach_ - centre, FloatLanes{} - kHalf),
               high = lesser(greater(FloatLanes{}, end) + reach_ - centre, FloatLanes{} + kHalf);
    const Across side = across(load(beams.slope_side + b), side_[axis], centre),
                 height = across(load(beams.slope_height + b), height_[axis], centre);
    for (const Across* each : {&side, &height}) {
      low = greater(low, (-kHalf - each->reach - each->turned) * each->inverse_slope);
      high = lesser(high, (kHalf + each->reach - each->turned) * each->inverse_slope);
    }
    low += kHalf + 1.0f - slack_;  // up to the next whole number
    high += kHalf + slack_;
    IntLanes alive = (low < high + 1.0f) & (countUp() < static_cast<std::int32_t>(range.last - b));
    IntLanes first = toInt(alive ? low : FloatLanes{}), last = toInt(alive ? high : FloatLanes{});
    alive &= first <= last;
    if (!anyOf(alive)) return to;
    IntLanes found = {}, from = {}, until = {};
    for (int k = 0; k < kGroupEdge; ++k) {
      const IntLanes here =
          (first < kBlockEdge * (k + 1)) & (last >= kBlockEdge * k) & alive &
          ((blocksOf(side, k, blocks_.side_from, blocks_.side_to) &
            blocksOf(height, k, blocks_.height_from, blocks_.height_to) & blocks_.layer[k][axis]) != 0);
      from = (here & ~found) ? IntLanes{} + kBlockEdge * k : from;
      until = here ? IntLanes{} + (kBlockEdge * (k + 1) - 1) : until;
      found |= here;
    }
    if (!anyOf(found)) return to;
    first = first > from ? first : from;
    last = last < until ? last : until;
    const FloatLanes skew = load(beams.skew + b);
    turnSkew(skew, side, first, last);
    return emit({countUp() + static_cast<std::int32_t>(b), first, last, slicing(axis, skew)}, found, to);
  }

 private:
  static constexpr auto kHalf = static_cast<float>(BeamBox::kHalf);

  /// As BeamSlicing numbers them.
  static IntLanes slicing(IntLanes axis, FloatLanes skew) {
    static_assert(BeamSlicing{0, 1}.number() == 3 && BeamSlicing{0, -1}.number() == 6);
    return axis + (skew == 0.0f ? IntLanes{} : skew > 0.0f ? IntLanes{} + 3 : IntLanes{} + 6);
  }
  /// Writes the passes found. @param numbers of a pass, in their order.
  static BeamPass* emit(const IntLanes (&numbers)[4], IntLanes found, BeamPass* to) {
    static_assert(sizeof(BeamPass) == 4 * sizeof(std::int32_t));
    alignas(64) std::int32_t passes[4 * kLanes];
    storeFours(passes, numbers);
    const IntLanes step = found & static_cast<std::int32_t>(sizeof(BeamPass));
    auto* bytes = reinterpret_cast<unsigned char*>(to);
    for (int n = 0; n < kLanes; ++n) {
      __builtin_memcpy(bytes, passes + fourOf(n), sizeof(BeamPass));
      bytes += step[n];
    }
    return reinterpret_cast<BeamPass*>(bytes);
  }

  /// How beams run along the side axis, or the height axis.
  struct Across {
    FloatLanes slope;
    FloatLanes at;             ///< place in the slice through the box's centre
    FloatLanes reach;          ///< of the kernel, at least
    FloatLanes inverse_slope;  ///< without its sign
    FloatLanes turned;         ///< `at`, with the axis turned so that the slope is positive
  };
  Across across(FloatLanes slope, FloatLanes centre, FloatLanes main) const {
    const FloatLanes at = main * slope - centre, size = greater(magnitude(slope), FloatLanes{} + 1e-9f);
    return {slope, at, reach_ * (1.0f + 0.5f * slope * slope) + slack_, 1.0f / size, slope < 0.0f ? -at : at};
  }
  /// Turns straight slices into skew ones that hold the same voxels which beams reach, where they are skew.
  void turnSkew(FloatLanes skew, const Across& side, IntLanes& first, IntLanes& last) const {
    // A column is up to half a voxel along the main axis from the beam's place in its skew slice.
    constexpr float kBehind = 64.0f;  // so that there are none below 0
    const FloatLanes by_voxel = 2.0f + magnitude(side.slope);
    const FloatLanes slice = skew * (side.at + kHalf) + (2.0f * kHalf + kBehind);  // at the box's centre
    const FloatLanes low = (toFloat(first) - (kHalf + 0.5f)) * by_voxel + slice,
                     high = (toFloat(last) - (kHalf - 0.5f)) * by_voxel + slice;
    const IntLanes straight = skew == 0.0f;
    first = straight ? first : toInt(low + 1.0f - slack_) - static_cast<std::int32_t>(kBehind);
    last = straight ? last : toInt(high + slack_) - static_cast<std::int32_t>(kBehind);
  }
  /// The blocks that beams reach in layer k.
  static IntLanes blocksOf(const Across& across, int k, const Table<std::int32_t>& from,
                           const Table<std::int32_t>& to) {
    constexpr float kToBlocks = 1.0f / kBlockEdge, kHalfLayer = 0.5f * (kBlockEdge - 1);
    const float middle = static_cast<float>(kBlockEdge * k) + kHalfLayer - kHalf;
    const FloatLanes at = (across.at + middle * across.slope + (kHalf + kBlockEdge)) * kToBlocks;
    const FloatLanes room = (across.reach + kHalfLayer * magnitude(across.slope)) * kToBlocks;
    const auto number = [](FloatLanes x) {
      return toInt(lesser(greater(x, FloatLanes{}), FloatLanes{} + (kGroupEdge + 1)));
    };
    return from[number(at - room)] & to[number(at + room)];
  }

  BoxBlocks blocks_;
  Table<float> main_, side_, height_;  ///< the box's centre by main axis
  float reach_, slack_;
};

/// So many passes ahead, tracks are sent for.
constexpr std::size_t kAhead = 8;

/// Finds the passes of beams through a box, in the order of the beams. Of kAhead behind the last, there are
/// any numbers. `sums` has room for all beams (GroupSums::reserve): a vector that grew here would leave its
/// code, compiled for this instruction set, to the linker's choice.
inline void findPasses(const BeamTrackArrays& beams, const BeamRange* ranges, std::size_t count,
                       const BeamBox& box, GroupSums& sums) {
  const BoxSearch search(box);
  static_assert(kLanes <= GroupSums::kPassPadding && kAhead <= GroupSums::kPassPadding);
  BeamPass* to = sums.passes.data();
  for (std::size_t r = 0; r < count; ++r) {
    for (BeamRange left = ranges[r]; left.first < left.last; left.first += kLanes) {
      to = search.find(beams, left, to);
    }
  }
  sums.pass_count = static_cast<std::size_t>(to - sums.passes.data());
}

}  // namespace
}  // namespace bki_mapping
