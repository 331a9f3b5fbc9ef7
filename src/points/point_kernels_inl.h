/// @file The sums of a kernel over points at the voxels of a block, over the vocabulary of simd/vec.h.
#pragma once

#include <algorithm>
#include <cstddef>

#include "bki_mapping/map/block.h"
#include "kernel/vec_kernel_inl.h"
#include "points/point_kernels.h"
#include "points/tile_kernels_inl.h"

namespace bki_mapping {
namespace {

/// A block's voxels with one more on each side.
constexpr int kHaloEdge = kBlockEdge + 2;
constexpr int kHaloVoxels = kHaloEdge * kHaloEdge * kHaloEdge;

/// The layers of the halo that points touch.
struct HaloLayers {
  int lowest = kHaloEdge, highest = -1;
};

/// Adds points to the eight voxel centres around each, for a kernel that reaches no farther than one voxel:
/// no other centre can be nearer than that. Some may lie outside the block, hence the halo. A point that
/// reaches the block has -1 <= x < 8, and the same for y and z; rounding may have made it 8.
///
/// In two stages, so that no point waits for the conversions that find its cell: first, for some points, the
/// cell of eight centres that holds each; then, from buffers, the kernel at the eight.
class HaloAdder {
 public:
  HaloAdder(float inverse_reach2, float* halo) : halo_(halo), scale_(VecKernel::kScale * inverse_reach2) {
    for (int lane = 0; lane < kLanes; ++lane) {
      right_[lane] = static_cast<float>(lane % 2);
      behind_[lane] = static_cast<float>(lane / 2 % 2);
      above_[lane] = static_cast<float>(lane / 4 % 2);
      point_[lane] = kFields * (lane / kCorners);
    }
  }

  void add(const PointRun& run) {
    for (std::size_t p = 0; p < run.count; p += kAtOnce) {
      const int count = static_cast<int>(std::min<std::size_t>(run.count - p, kAtOnce));
      findCells(run.points + p, count);
      if (run.weights == nullptr) {
        addAround<false>(count);
      } else {
        for (int n = 0; n < count; ++n)
          inside_[kFields * n + kWeight] = run.weights[p + static_cast<std::size_t>(n)];
        addAround<true>(count);
      }
    }
  }
  /// The layers that the added points touch; at least one point must have been added.
  HaloLayers touched() const {
    HaloLayers layers;
    for (int z = 2; z < kLanes; z += kFields) {
      layers.lowest = std::min(layers.lowest, static_cast<int>(lowest_[z]));
      layers.highest = std::max(layers.highest, static_cast<int>(highest_[z]) + 1);
    }
    return layers;
  }

 private:
  static constexpr int kAtOnce = 32, kCorners = 8;
  /// Of a point: x, y, z, and one that inside_ has for its weight.
  static constexpr int kFields = 4, kWeight = 3;
  static_assert(sizeof(LocalPoint) == kFields * sizeof(float) &&
                offsetof(LocalPoint, z) == 2 * sizeof(float));

  void findCells(const LocalPoint* points, int count) {
    constexpr int kStep = kLanes / kFields;
    for (int p = 0; p < count; p += kStep) {
      FloatVec c;
      if (p + kStep <= count) {
        c = LoadU(&points[p].x);
      } else {  // repeats the last point, because memory after it must not be read
        LocalPoint last[kStep];
        for (int n = 0; n < kStep; ++n) last[n] = points[std::min(p + n, count - 1)];
        c = LoadU(&last[0].x);
      }
      c += 1.0f;
      const IntVec cell = Min(ConvertTo<IntVec>(c), Set(kHaloEdge - 2));
      lowest_ = Min(lowest_, cell);
      highest_ = Max(highest_, cell);
      StoreU(cell, cell_ + kFields * p);
      StoreU(c - ConvertTo<FloatVec>(cell), inside_ + kFields * p);
    }
  }
  /// A field of inside_, that of each point in the lanes of its corners.
  [[gnu::always_inline]] static FloatVec inside(const float* from, int field, [[maybe_unused]] IntVec point) {
    if constexpr (kLanes <= kCorners) {
      return Set(from[field]);
    } else {
      return TableLookupLanes(LoadU(from), point + field);
    }
  }
  template <bool kWeighted>
  void addAround(int count) {
    constexpr int kPoints = std::max(kLanes / kCorners, 1), kVecs = std::max(kCorners / kLanes, 1),
                  kLayers = 2 / kVecs;  // of a point in a vector
    // In registers: the compiler must assume that adding to the halo changes members.
    const VecKernel kernel = kernel_;
    const FloatVec right = right_, behind = behind_, above = above_;
    const IntVec point = point_;
    const float scale = scale_;
    float* const halo = halo_;
    for (int p = 0; p < count; p += kPoints) {
      const float* const from = inside_ + kFields * p;
      const FloatVec dx = inside(from, 0, point) - right, dy = inside(from, 1, point) - behind,
                     z = inside(from, 2, point) - above;
      for (int vec = 0; vec < kVecs; ++vec) {
        const FloatVec dz = z - static_cast<float>(vec);
        FloatVec values = kernel(VecKernel::squared(dx * dx + dy * dy + dz * dz, scale));
        if constexpr (kWeighted) values *= inside(from, kWeight, point);
        for (int n = 0; n < kPoints && p + n < count; ++n) {
          const std::int32_t* const cell = cell_ + kFields * (p + n);
          float* first = halo + cell[0] + kHaloEdge * (cell[1] + kHaloEdge * (cell[2] + vec));
          for (int layer = 0; layer < kLayers; ++layer, first += kHaloEdge * kHaloEdge) {
            AddPairs(ExtractLanes<4>(values, kLayers * n + layer), first, first + kHaloEdge);
          }
        }
      }
    }
  }

  const VecKernel kernel_{};
  float* halo_;
  float scale_;
  FloatVec right_ = {}, behind_ = {}, above_ = {};  ///< the corner of a lane
  IntVec point_ = {};                               ///< the first field of a lane's point
  IntVec lowest_ = Set(kHaloEdge - 2), highest_ = {};
  // Field by field; vectors may go past the last.
  alignas(64) std::int32_t cell_[kFields * kAtOnce + kLanes];
  alignas(64) float inside_[kFields * kAtOnce + kLanes];
};

/// The kernel's tail may be a little below 0.
[[gnu::always_inline]] inline float notNegative(float sum) {
  return sum > 0.0f ? sum : 0.0f;
}

Block::Layers sumOfNearestEight(const PointRun* runs, std::size_t count, float inverse_reach2, float scale,
                                float* sums) {
  alignas(64) float halo[kHaloVoxels];
  for (float& sum : halo) sum = 0.0f;
  HaloAdder adder(inverse_reach2, halo);
  for (const PointRun* run = runs; run != runs + count; ++run) adder.add(*run);
  const HaloLayers touched = adder.touched();
  const float* in = halo + kHaloEdge * kHaloEdge;
  float* out = sums;
  for (int k = 0; k < kBlockEdge; ++k) {
    in += kHaloEdge + 1;
    for (int j = 0; j < kBlockEdge; ++j) {
      for (int i = 0; i < kBlockEdge; ++i) out[i] = notNegative(scale * in[i]);
      in += kHaloEdge;
      out += kBlockEdge;
    }
    in += kHaloEdge - 1;
  }
  // Layer k of the halo is layer k - 1 of the block.
  const int first = touched.lowest - 1, last = touched.highest - 1;
  return {first > 0 ? first : 0, last < kBlockEdge - 1 ? last + 1 : kBlockEdge};
}

/// For a kernel of any reach. Lanes are the voxels of a row, or of adjacent rows where a vector is longer.
template <bool kWeighted>
void addPointsToRows(const PointRun& run, float reach, float inverse_reach2, float* sums) {
  constexpr int kRows = kLanes > kBlockEdge ? kLanes / kBlockEdge : 1, kStep = kRows * kBlockEdge;
  const auto first = [reach](float c) { return c > reach ? static_cast<int>(c - reach) : 0; };
  const auto last = [reach](float c) {
    return c + reach < kBlockEdge - 1 ? static_cast<int>(c + reach) : kBlockEdge - 1;
  };
  const VecKernel kernel;
  const float scale = VecKernel::kScale * inverse_reach2;
  FloatVec in_row, row_of;
  for (int lane = 0; lane < kLanes; ++lane) {
    in_row[lane] = static_cast<float>(lane % kBlockEdge);
    row_of[lane] = static_cast<float>(lane / kBlockEdge);
  }
  for (std::size_t p = 0; p < run.count; ++p) {
    const LocalPoint point = run.points[p];
    for (int k = first(point.z); k <= last(point.z); ++k) {
      const float dz = static_cast<float>(k) - point.z;
      for (int j = first(point.y) / kRows * kRows; j <= last(point.y); j += kRows) {
        const FloatVec dy = row_of + (static_cast<float>(j) - point.y), yz2 = dy * dy + dz * dz;
        float* const rows = sums + kBlockEdge * (j + kBlockEdge * k);
        for (int i = 0; i < kStep; i += kLanes) {
          const FloatVec dx = in_row + (static_cast<float>(i) - point.x);
          FloatVec values = kernel(VecKernel::squared(dx * dx + yz2, scale));
          if constexpr (kWeighted) values *= run.weights[p];
          AddU(values, rows + i);
        }
      }
    }
  }
}

Block::Layers sumPoints(const PointRun* runs, std::size_t count, float reach, float scale, float* sums) {
  const float inverse_reach2 = 1.0f / (reach * reach);
  if (reach <= 1.0f) return sumOfNearestEight(runs, count, inverse_reach2, scale, sums);
  for (int v = 0; v < kBlockVoxels; ++v) sums[v] = 0.0f;
  for (const PointRun* run = runs; run != runs + count; ++run) {
    const auto add = run->weights == nullptr ? addPointsToRows<false> : addPointsToRows<true>;
    add(*run, reach, inverse_reach2, sums);
  }
  for (int v = 0; v < kBlockVoxels; ++v) sums[v] = notNegative(scale * sums[v]);
  return {};
}

constexpr PointKernels kPointKernels = {kInstructionSet, sumPoints, locatePoints, locateCells, reachBlocks};

}  // namespace
}  // namespace bki_mapping
