/// @file The innermost loop of point evidence; each instruction set's file includes it and gets a copy of its
/// own.
#pragma once

#include <algorithm>
#include <cmath>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "bki_mapping/map/block.h"
#include "kernel/lane_kernel.h"
#include "kernel/sparse_kernel.h"
#include "points/local_point.h"
#include "simd/lanes.h"

namespace bki_mapping {
namespace {

/// A block's voxels with one more on each side.
constexpr int kHaloEdge = kBlockEdge + 2;
constexpr int kHaloVoxels = kHaloEdge * kHaloEdge * kHaloEdge;

/// The layers of the halo that points touch.
struct HaloLayers {
  int lowest = kHaloEdge, highest = -1;
};

// Adding points to the eight voxel centres around each, for a kernel that reaches no farther than one voxel:
// no other can be nearer than that. They may lie outside the block, hence the halo. A point that reaches the
// block has -1 <= x < 8, and the same for y and z; rounding may have made it 8.
#if defined(__AVX2__)

/// Adds eight values to the halo's voxels from `first` on: two rows of two, in each of two layers.
[[gnu::always_inline]] inline void addCorners(__m128 low, __m128 high, float* first) {
  for (const __m128& layer : {low, high}) {
    addPairs(first, first + kHaloEdge, layer);
    first += kHaloEdge * kHaloEdge;
  }
}

#endif

#if defined(__AVX512F__)

/// Two points at a time.
HaloLayers addToHalo(const PointRun& run, float inverse_reach2, float* halo) {
  static_assert(sizeof(LocalPoint) == 16);
  const LaneKernel kernel;
  const float scale = LaneKernel::kScale * inverse_reach2;
  const __m256i most = _mm256_set1_epi32(kHaloEdge - 2);
  const __m256i steps = _mm256_setr_epi16(1, 0, kHaloEdge, 0, kHaloEdge * kHaloEdge, 0, 0, 0,  //
                                          1, 0, kHaloEdge, 0, kHaloEdge * kHaloEdge, 0, 0, 0);
  const auto eachOf = [](int n) {
    return _mm512_setr_epi32(n, n, n, n, n, n, n, n, n + 4, n + 4, n + 4, n + 4, n + 4, n + 4, n + 4, n + 4);
  };
  const __m512i xs = eachOf(0), ys = eachOf(1), zs = eachOf(2);
  const FloatLanes right = {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1},
                   behind = {0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1},
                   above = {0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 1, 1, 1, 1};
  __m256i lowest = most, highest = _mm256_setzero_si256();
  const auto addTwo = [&](const LocalPoint* points, bool both) {
    // x, y and z side by side; what stands behind them comes to nothing.
    const __m256 c = _mm256_loadu_ps(&points->x) + 1.0f;
    const __m256i index = _mm256_min_epi32(_mm256_cvttps_epi32(c), most);
    const __m512 inside = _mm512_castps256_ps512(c - _mm256_cvtepi32_ps(index));
    lowest = _mm256_min_epi32(lowest, index);
    highest = _mm256_max_epi32(highest, index);
    __m256i first = _mm256_madd_epi16(index, steps);
    first = _mm256_add_epi32(first, _mm256_shuffle_epi32(first, _MM_SHUFFLE(1, 0, 3, 2)));
    first = _mm256_add_epi32(first, _mm256_shuffle_epi32(first, _MM_SHUFFLE(2, 3, 0, 1)));

    const FloatLanes dx = _mm512_permutexvar_ps(xs, inside) - right,
                     dy = _mm512_permutexvar_ps(ys, inside) - behind,
                     dz = _mm512_permutexvar_ps(zs, inside) - above;
    const __m512 values = kernel((dx * dx + dy * dy + dz * dz) * scale + LaneKernel::kShift);
    addCorners(_mm512_castps512_ps128(values), _mm512_extractf32x4_ps(values, 1),
               halo + _mm256_extract_epi32(first, 0));
    if (both) {
      addCorners(_mm512_extractf32x4_ps(values, 2), _mm512_extractf32x4_ps(values, 3),
                 halo + _mm256_extract_epi32(first, 4));
    }
  };
  std::size_t p = 0;
  for (; p + 2 <= run.count; p += 2) addTwo(run.points + p, true);
  if (p < run.count) {
    const LocalPoint last[2] = {run.points[p], run.points[p]};
    addTwo(last, false);
  }
  const auto least = [](__m256i both) {
    return std::min(_mm256_extract_epi32(both, 2), _mm256_extract_epi32(both, 6));
  };
  const auto greatest = [](__m256i both) {
    return std::max(_mm256_extract_epi32(both, 2), _mm256_extract_epi32(both, 6));
  };
  return {least(lowest), greatest(highest) + 1};
}

#elif defined(__AVX2__)

typedef float Eight __attribute__((vector_size(8 * sizeof(float))));

HaloLayers addToHalo(const PointRun& run, float inverse_reach2, float* halo) {
  const __m128i most = _mm_set1_epi32(kHaloEdge - 2);
  const __m128i steps = _mm_setr_epi16(1, 0, kHaloEdge, 0, kHaloEdge * kHaloEdge, 0, 0, 0);
  __m128i lowest = most, highest = _mm_setzero_si128();
  for (std::size_t p = 0; p < run.count; ++p) {
    // x, y and z side by side; what stands behind them comes to nothing.
    const __m128 c = _mm_loadu_ps(&run.points[p].x) + 1.0f;
    const __m128i index = _mm_min_epi32(_mm_cvttps_epi32(c), most);
    const __m128 inside = c - _mm_cvtepi32_ps(index);
    lowest = _mm_min_epi32(lowest, index);
    highest = _mm_max_epi32(highest, index);
    __m128i first = _mm_madd_epi16(index, steps);
    first = _mm_add_epi32(first, _mm_shuffle_epi32(first, _MM_SHUFFLE(1, 0, 3, 2)));
    first = _mm_add_epi32(first, _mm_shuffle_epi32(first, _MM_SHUFFLE(2, 3, 0, 1)));

    const Eight dx = Eight(_mm256_broadcastss_ps(inside)) - Eight{0, 1, 0, 1, 0, 1, 0, 1},
                dy = Eight(_mm256_broadcastss_ps(_mm_movehdup_ps(inside))) - Eight{0, 0, 1, 1, 0, 0, 1, 1},
                dz = Eight(_mm256_broadcastss_ps(_mm_movehl_ps(inside, inside))) -
                     Eight{0, 0, 0, 0, 1, 1, 1, 1};
    const Eight r = _mm256_sqrt_ps((dx * dx + dy * dy + dz * dz) * inverse_reach2);
    const Eight values = sparseKernel(r, Eight(_mm256_max_ps(1.0f - r, Eight{})));

    addCorners(_mm256_castps256_ps128(values), _mm256_extractf128_ps(values, 1),
               halo + _mm_cvtsi128_si32(first));
  }
  return {_mm_extract_epi32(lowest, 2), _mm_extract_epi32(highest, 2) + 1};
}

#else

/// The place in the halo of the nearer lower voxel centre.
[[gnu::always_inline]] inline int firstNear(float c) {
  const int first = static_cast<int>(c + 1.0f);
  return first < kHaloEdge - 2 ? first : kHaloEdge - 2;
}

HaloLayers addToHalo(const PointRun& run, float inverse_reach2, float* halo) {
  HaloLayers layers;
  for (std::size_t p = 0; p < run.count; ++p) {
    const LocalPoint& point = run.points[p];
    const int i = firstNear(point.x), j = firstNear(point.y), k = firstNear(point.z);
    const float x = point.x + 1.0f - static_cast<float>(i), y = point.y + 1.0f - static_cast<float>(j),
                z = point.z + 1.0f - static_cast<float>(k);
    layers.lowest = k < layers.lowest ? k : layers.lowest;
    layers.highest = k >= layers.highest ? k + 1 : layers.highest;
    for (int corner = 0; corner < 8; ++corner) {
      const int di = corner & 1, dj = corner >> 1 & 1, dk = corner >> 2;
      const float dx = x - static_cast<float>(di), dy = y - static_cast<float>(dj),
                  dz = z - static_cast<float>(dk);
      halo[i + di + kHaloEdge * (j + dj + kHaloEdge * (k + dk))] +=
          sparseKernel((dx * dx + dy * dy + dz * dz) * inverse_reach2);
    }
  }
  return layers;
}

#endif

/// The kernel's tail may be a little below 0.
[[gnu::always_inline]] inline float notNegative(float sum) {
  return sum > 0.0f ? sum : 0.0f;
}

Block::Layers sumOfNearestEight(const PointRun* runs, std::size_t count, float inverse_reach2, float scale,
                                float* sums) {
  alignas(64) float halo[kHaloVoxels];
  for (float& sum : halo) sum = 0.0f;
  HaloLayers touched;
  for (const PointRun* run = runs; run != runs + count; ++run) {
    const HaloLayers layers = addToHalo(*run, inverse_reach2, halo);
    touched.lowest = layers.lowest < touched.lowest ? layers.lowest : touched.lowest;
    touched.highest = layers.highest > touched.highest ? layers.highest : touched.highest;
  }
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

/// For a kernel of any reach: the voxels of a layer side by side, as many rows at a time as lanes hold.
void addPointsToRows(const PointRun& run, float reach, float inverse_reach2, float* sums) {
  constexpr int kRows = kLanes > kBlockEdge ? kLanes / kBlockEdge : 1, kStep = kRows * kBlockEdge;
  const auto first = [reach](float c) { return c > reach ? static_cast<int>(c - reach) : 0; };
  const auto last = [reach](float c) {
    return c + reach < kBlockEdge - 1 ? static_cast<int>(c + reach) : kBlockEdge - 1;
  };
  const LaneKernel kernel;
  const float scale = LaneKernel::kScale * inverse_reach2;
  FloatLanes in_row, row_of;
  for (int lane = 0; lane < kLanes; ++lane) {
    in_row[lane] = static_cast<float>(lane % kBlockEdge);
    row_of[lane] = static_cast<float>(lane / kBlockEdge);
  }
  for (std::size_t p = 0; p < run.count; ++p) {
    const LocalPoint point = run.points[p];
    for (int k = first(point.z); k <= last(point.z); ++k) {
      const float dz = static_cast<float>(k) - point.z;
      for (int j = first(point.y) / kRows * kRows; j <= last(point.y); j += kRows) {
        const FloatLanes dy = row_of + (static_cast<float>(j) - point.y), yz2 = dy * dy + dz * dz;
        float* const rows = sums + kBlockEdge * (j + kBlockEdge * k);
        for (int i = 0; i < kStep; i += kLanes) {
          const FloatLanes dx = in_row + (static_cast<float>(i) - point.x);
          store(rows + i, load(rows + i) + kernel((dx * dx + yz2) * scale + LaneKernel::kShift));
        }
      }
    }
  }
}

Block::Layers sumPointsLoop(const PointRun* runs, std::size_t count, float reach, float scale, float* sums) {
  const float inverse_reach2 = 1.0f / (reach * reach);
  if (reach <= 1.0f) return sumOfNearestEight(runs, count, inverse_reach2, scale, sums);
  for (int v = 0; v < kBlockVoxels; ++v) sums[v] = 0.0f;
  for (std::size_t r = 0; r < count; ++r) addPointsToRows(runs[r], reach, inverse_reach2, sums);
  for (int v = 0; v < kBlockVoxels; ++v) sums[v] = notNegative(scale * sums[v]);
  return {};
}

}  // namespace
}  // namespace bki_mapping
