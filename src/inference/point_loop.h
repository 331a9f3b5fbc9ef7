/// @file The innermost loop of point evidence; each instruction set's file includes it and gets a copy of its
/// own.
#pragma once

#include "bki_mapping/core/block.h"
#include "bki_mapping/inference/kernel.h"
#include "bki_mapping/inference/local_point.h"

namespace bki_mapping {
namespace {

typedef float Two __attribute__((vector_size(2 * sizeof(float))));

/// A block's voxels with one more on each side.
constexpr int kHaloEdge = kBlockEdge + 2;
constexpr int kHaloVoxels = kHaloEdge * kHaloEdge * kHaloEdge;

/// The place in the halo of the nearer lower voxel centre. @param c -1 to 8; rounding may have made it 8.
[[gnu::always_inline]] inline int firstNear(float c) {
  const int first = static_cast<int>(c + 1.0f);
  return first < kHaloEdge - 2 ? first : kHaloEdge - 2;
}

/// Adds a point to the eight voxel centres around it, for a kernel that reaches no farther than one voxel: no
/// other can be nearer than that. They may lie outside the block, hence the halo.
/// @return the lower of their layers in the halo.
[[gnu::always_inline]] inline int addToNearestEight(const LocalPoint& point, float inverse_reach2,
                                                    float* halo) {
  // -1 <= x < 8, and the same for y and z, if the point reaches the block.
  const int i = firstNear(point.x), j = firstNear(point.y), k = firstNear(point.z);
  const float x = point.x + 1.0f - static_cast<float>(i), y = point.y + 1.0f - static_cast<float>(j),
              z = point.z + 1.0f - static_cast<float>(k);
  alignas(32) float values[8];
  for (int corner = 0; corner < 8; ++corner) {
    const float dx = x - static_cast<float>(corner & 1), dy = y - static_cast<float>(corner >> 1 & 1),
                dz = z - static_cast<float>(corner >> 2);
    values[corner] = sparseKernel((dx * dx + dy * dy + dz * dz) * inverse_reach2);
  }
  float* const first = halo + i + kHaloEdge * (j + kHaloEdge * k);
  for (int row = 0; row < 4; ++row) {
    float* const out = first + kHaloEdge * ((row & 1) + kHaloEdge * (row >> 1));
    Two sum, value;
    __builtin_memcpy(&sum, out, sizeof(Two));
    __builtin_memcpy(&value, values + 2 * row, sizeof(Two));
    sum += value;
    __builtin_memcpy(out, &sum, sizeof(Two));
  }
  return k;
}

Block::Layers sumOfNearestEight(const PointRun* runs, std::size_t count, float inverse_reach2, float scale,
                                float* sums) {
  alignas(64) float halo[kHaloVoxels];
  for (float& sum : halo) sum = 0.0f;
  int lowest = kBlockEdge, highest = 0;  // of the lower layers, in the halo
  for (const PointRun* run = runs; run != runs + count; ++run) {
    for (std::size_t p = 0; p < run->count; ++p) {
      const int layer = addToNearestEight(run->points[p], inverse_reach2, halo);
      lowest = layer < lowest ? layer : lowest;
      highest = layer > highest ? layer : highest;
    }
  }
  for (int row = 0; row < kBlockEdge * kBlockEdge; ++row) {
    const float* in = halo + 1 + kHaloEdge * (row % kBlockEdge + 1 + kHaloEdge * (row / kBlockEdge + 1));
    for (int i = 0; i < kBlockEdge; ++i) sums[kBlockEdge * row + i] = scale * in[i];
  }
  // Layer k of the halo is layer k - 1 of the block.
  return {lowest > 0 ? lowest - 1 : 0, highest + 1 < kBlockEdge ? highest + 1 : kBlockEdge};
}

/// For a kernel of any reach: the rows of eight voxels that a point may reach.
void addPointsToRows(const PointRun& run, float reach, float inverse_reach2, float* sums) {
  const auto first = [reach](float c) { return c > reach ? static_cast<int>(c - reach) : 0; };
  const auto last = [reach](float c) {
    return c + reach < kBlockEdge - 1 ? static_cast<int>(c + reach) : kBlockEdge - 1;
  };
  for (std::size_t p = 0; p < run.count; ++p) {
    const LocalPoint point = run.points[p];
    for (int k = first(point.z); k <= last(point.z); ++k) {
      const float dz = static_cast<float>(k) - point.z;
      for (int j = first(point.y); j <= last(point.y); ++j) {
        const float dy = static_cast<float>(j) - point.y;
        const float yz2 = dy * dy + dz * dz;
        float* row = sums + kBlockEdge * (j + kBlockEdge * k);
        for (int i = 0; i < kBlockEdge; ++i) {
          const float dx = static_cast<float>(i) - point.x;
          row[i] += sparseKernel((dx * dx + yz2) * inverse_reach2);
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
  for (int v = 0; v < kBlockVoxels; ++v) sums[v] *= scale;
  return {};
}

}  // namespace
}  // namespace bki_mapping
