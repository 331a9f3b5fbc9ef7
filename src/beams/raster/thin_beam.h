/// @file Beams of a short kernel, added to one column of each skew slice, and of that to the two voxels
/// between which the beam passes, or to four. Included by trace_loop.h alone.
#pragma once

#include "beams/raster/group_sums.h"
#include "beams/raster/lane_weight.h"
#include "beams/raster/traced_beam.h"
#include "kernel/lane_kernel.h"
#include "simd/lanes.h"

namespace bki_mapping {
namespace {

/// The fraction of a place in voxels, and 1: in [1, 2), without rounding.
[[gnu::always_inline]] inline FloatLanes fractionAndOne(IntLanes place) {
  static_assert(kTrackBits == 23, "the bits of a float's fraction");
  return reinterpret_cast<FloatLanes>((place & (kTrackVoxel - 1)) | 0x3f800000);
}

/// Slices of beams, gathered until there are many: first where they are is found, a beam at a time, then they
/// are added, one slice like the other. Lanes are slices. @tparam kVoxels of a slice, 2 or 4.
template <BeamWeight kWeight, int kVoxels>
class ThinSlices {
 public:
  explicit ThinSlices(const LaneKernel& kernel) : kernel_(kernel) {}

  /// Takes slices of a beam, up to kRoom. @param sums at the group's first voxel. @param middle slice, in
  /// which the beam's place is.
  [[gnu::always_inline]] void add(const TracedBeam& beam, int first, int slices, int middle, float* sums,
                                  SliceStrides strides) {
    if (sums != sums_ || count_ + slices > kRoom) flush();
    sums_ = sums;
    const int begin = count_, end = begin + slices;
    const BeamTrack& track = beam.track;
    const IntLanes number = countUp() + (first - middle);
    // The nearest column, and of it the lowest voxel.
    constexpr int kBelow = kVoxels / 2 - 1;  // under the one below the beam
    IntLanes side = number * track.step_side + (beam.side + kTrackVoxel / 2),
             height = number * track.step_height + (beam.height - kBelow * kTrackVoxel),
             slice = (number + middle) * strides.slice;
    FloatLanes step = toFloat(number);
    int n = begin;
    do {  // there is a slice
      // A column's voxels stand one behind the other.
      store(voxel_ + n, (side >> kTrackBits) * strides.side + (height >> kTrackBits) + slice);
      // That voxel's place, from the beam's on.
      const FloatLanes s = 1.5f - fractionAndOne(side),
                       h = static_cast<float>(1 - kBelow) - fractionAndOne(height);
      FloatLanes e = s * track.e_side + h * track.e_height, g = h * track.g_height,
                 w = step * track.rho_slice + beam.rho + s * track.rho_side + h * track.rho_height;
      for (int voxel = 0; voxel < kVoxels; ++voxel) {
        store(squared_[voxel] + n, e * e + LaneKernel::kShift + g * g);
        store(rho_[voxel] + n, w);
        e += track.e_height;
        g += track.g_height;
        w += track.rho_height;
      }
      side += kLanes * track.step_side;
      height += kLanes * track.step_height;
      slice += kLanes * strides.slice;
      step += static_cast<float>(kLanes);
      n += kLanes;
    } while (n < end);
    // Two pairs are added at a time, which have to be of one beam: with the slice behind, if need be.
    count_ = kVoxels == 2 ? end + end % 2 : end;
  }

  /// Adds what is gathered to the sums.
  void flush() {
    if (count_ == 0) return;
    int end = count_;
    for (; end % kLanes != 0; ++end) {
      voxel_[end] = kNowhere;
      for (int voxel = 0; voxel < kVoxels; ++voxel) squared_[voxel][end] = rho_[voxel][end] = 0.0f;
    }
    // Of the lanes before and those at hand by turns: what is added then has not to wait for its values.
    const LaneKernel kernel = kernel_;  // in registers
    alignas(64) float even[kVoxels * kLanes], odd[kVoxels * kLanes];
    compute(kernel, 0, even);
    int n = 0;
    for (; n + 2 * kLanes < end; n += 2 * kLanes) {
      compute(kernel, n + kLanes, odd);
      addLanes(n, even);
      compute(kernel, n + 2 * kLanes, even);
      addLanes(n + kLanes, odd);
    }
    addLanes(n, even);
    if (n + kLanes < end) {
      compute(kernel, n + kLanes, odd);
      addLanes(n + kLanes, odd);
    }
    count_ = 0;
  }

 private:
  static constexpr int kRoom = 512;
  static constexpr int kNowhere = -GroupSums::kPad;  ///< beside the group

  [[gnu::always_inline]] void compute(const LaneKernel& kernel, int n, float* by_slice) const {
    FloatLanes values[kVoxels];
    for (int voxel = 0; voxel < kVoxels; ++voxel) {
      values[voxel] = Weight<kWeight>::at(load(rho_[voxel] + n)) * kernel(load(squared_[voxel] + n));
    }
    if constexpr (kVoxels == 2) {
      storePairs(by_slice, values[0], values[1]);
    } else {
      storeFours(by_slice, values);
    }
  }
  [[gnu::always_inline]] void addLanes(int n, const float* by_slice) const {
    Part<4>::Lanes four;
    for (int lane = 0; lane < kLanes; lane += 4 / kVoxels) {
      float* const first = sums_ + voxel_[n + lane];
      if constexpr (kVoxels == 2) {
        __builtin_memcpy(&four, by_slice + pairOf(lane), sizeof(four));
        addPairs(first, sums_ + voxel_[n + lane + 1], four);
      } else {
        __builtin_memcpy(&four, by_slice + fourOf(lane), sizeof(four));
        addTo(first, four);
      }
    }
  }

  const LaneKernel kernel_;
  float* sums_ = nullptr;
  int count_ = 0;
  // Where the slices' voxels are, their squared distance as the kernel takes it, and rho.
  alignas(64) std::int32_t voxel_[kRoom + kLanes];
  alignas(64) float squared_[kVoxels][kRoom + kLanes];
  alignas(64) float rho_[kVoxels][kRoom + kLanes];
};

}  // namespace
}  // namespace bki_mapping
