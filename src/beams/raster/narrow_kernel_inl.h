/// @file Beams of a short kernel, added to one column of each skew slice, and of that to the two voxels
/// between which the beam passes, or to four. Included by trace_loop.h alone.
#pragma once

#include "beams/raster/group_sums.h"
#include "beams/raster/slices_inl.h"
#include "kernel/vec_kernel_inl.h"

namespace bki_mapping {
namespace {

/// The fraction of a place in voxels, and 1: in [1, 2), without rounding.
[[gnu::always_inline]] inline FloatVec fractionAndOne(IntVec place) {
  static_assert(kPositionBits == 23, "the bits of a float's fraction");
  return BitCast<FloatVec>((place & (kOneVoxel - 1)) | 0x3f800000);
}

/// Slices of beams, gathered until there are many: first where they are is found, a beam at a time, then they
/// are added, one slice like the other. Lanes are slices. @tparam kVoxels of a slice, 2 or 4.
template <BeamWeight kWeight, int kVoxels>
class NarrowKernelRaster {
 public:
  explicit NarrowKernelRaster(const VecKernel& kernel) : kernel_(kernel) {}

  /// Takes slices of a beam, up to kRoom. @param sums at the group's first voxel. @param middle slice, in
  /// which the beam's place is.
  [[gnu::always_inline]] void add(const LineInBox& beam, int first, int slices, int middle, float* sums,
                                  SliceStrides strides) {
    if (sums != sums_ || count_ + slices > kRoom) flush();
    sums_ = sums;
    const int begin = count_, end = begin + slices;
    const LineSetup& line = beam.line;
    const IntVec number = Iota() + (first - middle);
    // The nearest column, and of it the lowest voxel.
    constexpr int kBelow = kVoxels / 2 - 1;  // under the one below the beam
    IntVec side = number * line.step_side + (beam.side + kOneVoxel / 2),
           height = number * line.step_height + (beam.height - kBelow * kOneVoxel),
           slice = (number + middle) * strides.slice;
    FloatVec step = ConvertTo<FloatVec>(number);
    int n = begin;
    do {  // there is a slice
      // A column's voxels stand one behind the other.
      StoreU((side >> kPositionBits) * strides.side + (height >> kPositionBits) + slice, voxel_ + n);
      // That voxel's place, from the beam's on.
      const FloatVec s = 1.5f - fractionAndOne(side),
                     h = static_cast<float>(1 - kBelow) - fractionAndOne(height);
      FloatVec e = s * line.e_side + h * line.e_height, g = h * line.g_height,
               w = step * line.rho_slice + beam.rho + s * line.rho_side + h * line.rho_height;
      for (int voxel = 0; voxel < kVoxels; ++voxel) {
        StoreU(VecKernel::squared(e, g), squared_[voxel] + n);
        StoreU(w, rho_[voxel] + n);
        e += line.e_height;
        g += line.g_height;
        w += line.rho_height;
      }
      side += kLanes * line.step_side;
      height += kLanes * line.step_height;
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
    const VecKernel kernel = kernel_;  // in registers
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

  [[gnu::always_inline]] void compute(const VecKernel& kernel, int n, float* by_slice) const {
    FloatVec values[kVoxels];
    for (int voxel = 0; voxel < kVoxels; ++voxel) {
      values[voxel] = VecWeight<kWeight>::at(LoadU(rho_[voxel] + n)) * kernel(LoadU(squared_[voxel] + n));
    }
    if constexpr (kVoxels == 2) {
      StoreInterleaved2(values[0], values[1], by_slice);
    } else {
      StoreInterleaved4(values, by_slice);
    }
  }
  [[gnu::always_inline]] void addLanes(int n, const float* by_slice) const {
    for (int lane = 0; lane < kLanes; lane += 4 / kVoxels) {
      float* const first = sums_ + voxel_[n + lane];
      if constexpr (kVoxels == 2) {
        AddPairs(LoadFour(by_slice + Interleaved2(lane)), first, sums_ + voxel_[n + lane + 1]);
      } else {
        AddU(LoadFour(by_slice + Interleaved4(lane)), first);
      }
    }
  }

  const VecKernel kernel_;
  float* sums_ = nullptr;
  int count_ = 0;
  // Where the slices' voxels are, their squared distance as the kernel takes it, and rho.
  alignas(64) std::int32_t voxel_[kRoom + kLanes];
  alignas(64) float squared_[kVoxels][kRoom + kLanes];
  alignas(64) float rho_[kVoxels][kRoom + kLanes];
};

}  // namespace
}  // namespace bki_mapping
