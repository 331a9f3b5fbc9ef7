/// @file Narrow kernels: beams added to one column of each sheared slice, to the two voxels between which the
/// line passes, or to four. Part of line_kernels_inl.h.
#pragma once

#include "beams/raster/group_sums.h"
#include "beams/raster/slices_inl.h"
#include "kernel/vec_kernel_inl.h"

namespace bki_mapping {
namespace {

/// 1 + the fraction of a fixed-point position, in [1, 2), without rounding: the fraction's bits are a
/// float's.
[[gnu::always_inline]] inline FloatVec onePlusFraction(IntVec position) {
  static_assert(kPositionBits == 23, "the bits of a float's fraction");
  return BitCast<FloatVec>((position & (kOneVoxel - 1)) | 0x3f800000);
}

/// Lanes are slices. The number of slices of a beam in a box is seldom a multiple of kLanes; so the slices of
/// many beams are gathered, a beam at a time, and then added in full vectors.
/// @tparam kVoxels of a slice, 2 or 4: lines that climb steeply along a column reach four.
template <BeamWeight kWeight, int kVoxels>
class NarrowKernelRaster {
 public:
  explicit NarrowKernelRaster(const VecKernel& kernel) : kernel_(kernel) {}

  /// Gathers slices of a beam, up to kRoom. @param sums at the group's first voxel. @param middle the slice
  /// in which the line's position is given.
  [[gnu::always_inline]] void add(const LineInBox& beam, int first, int slices, int middle, float* sums,
                                  SliceStrides strides) {
    if (sums != sums_ || count_ + slices > kRoom) flush();
    sums_ = sums;
    const int begin = count_, end = begin + slices;
    const LineSetup& line = beam.line;
    const IntVec number = Iota() + (first - middle);
    // The nearest column, and the lowest of its voxels.
    constexpr int kBelow = kVoxels / 2 - 1;  // voxels under the one next below the line
    IntVec side = number * line.step_side + (beam.side + kOneVoxel / 2),
           height = number * line.step_height + (beam.height - kBelow * kOneVoxel),
           slice = (number + middle) * strides.slice;
    FloatVec step = ConvertTo<FloatVec>(number);
    int n = begin;
    do {  // there is a slice
      // The voxels of a column are adjacent in memory.
      StoreU((side >> kPositionBits) * strides.side + (height >> kPositionBits) + slice, voxel_ + n);
      // That voxel from the line.
      const FloatVec s = 1.5f - onePlusFraction(side),
                     h = static_cast<float>(1 - kBelow) - onePlusFraction(height);
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
    // Pairs are added two at a time and must not overlap; those of two slices of one beam never do. If the
    // count is odd, a slice of zeros after the last completes the pair.
    count_ = kVoxels == 2 ? end + end % 2 : end;
  }

  /// Adds all that is gathered.
  void flush() {
    if (count_ == 0) return;
    int end = count_;
    for (; end % kLanes != 0; ++end) {
      voxel_[end] = kNowhere;
      for (int voxel = 0; voxel < kVoxels; ++voxel) squared_[voxel][end] = rho_[voxel][end] = 0.0f;
    }
    // Software-pipelined: compute the next vector while the previous one is scattered.
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
  static constexpr int kNowhere = -GroupSums::kPad;  ///< a voxel in the padding beside the group

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
  // For each slice its lowest voxel; for each voxel the squared distance, in the kernel's unit, and rho.
  alignas(64) std::int32_t voxel_[kRoom + kLanes];
  alignas(64) float squared_[kVoxels][kRoom + kLanes];
  alignas(64) float rho_[kVoxels][kRoom + kLanes];
};

}  // namespace
}  // namespace bki_mapping
