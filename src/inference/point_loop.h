/// @file The innermost loop of point evidence; each instruction set's file includes it and gets a copy of its
/// own.
#pragma once

#include "bki_mapping/core/types.h"
#include "bki_mapping/inference/kernel.h"
#include "bki_mapping/inference/local_point.h"

namespace bki_mapping {
namespace {

/// A block's voxels with one more on each side.
constexpr int kHaloEdge = kBlockEdge + 2;
constexpr int kHaloVoxels = kHaloEdge * kHaloEdge * kHaloEdge;

/// The place in the halo of the nearer lower voxel centre. @param c -1 to 8; rounding may have made it 8.
[[gnu::always_inline]] inline int firstNear(float c) {
  const int first = static_cast<int>(c + 1.0f);
  return first < kHaloEdge - 2 ? first : kHaloEdge - 2;
}

/// For a kernel that reaches no farther than one voxel: only the eight voxel centres around a point can be
/// nearer than that. They may lie outside the block, hence the halo.
void addPointsToNearestEight(const LocalPoint* points, std::size_t count, float inverse_reach2, float* sums) {
  alignas(64) float halo[kHaloVoxels];
  for (float& sum : halo) sum = 0.0f;
  for (std::size_t p = 0; p < count; ++p) {
    // -1 <= x < 8, and the same for y and z, if the point reaches the block.
    const int i = firstNear(points[p].x), j = firstNear(points[p].y), k = firstNear(points[p].z);
    const float x = points[p].x + 1.0f - static_cast<float>(i),
                y = points[p].y + 1.0f - static_cast<float>(j),
                z = points[p].z + 1.0f - static_cast<float>(k);
    alignas(32) float values[8];
    for (int corner = 0; corner < 8; ++corner) {
      const float dx = x - static_cast<float>(corner & 1), dy = y - static_cast<float>(corner >> 1 & 1),
                  dz = z - static_cast<float>(corner >> 2);
      values[corner] = sparseKernel((dx * dx + dy * dy + dz * dz) * inverse_reach2);
    }
    float* first = halo + i + kHaloEdge * (j + kHaloEdge * k);
    for (int row = 0; row < 4; ++row) {
      float* out = first + kHaloEdge * ((row & 1) + kHaloEdge * (row >> 1));
      out[0] += values[2 * row];
      out[1] += values[2 * row + 1];
    }
  }
  for (int row = 0; row < kBlockEdge * kBlockEdge; ++row) {
    const float* in = halo + 1 + kHaloEdge * (row % kBlockEdge + 1 + kHaloEdge * (row / kBlockEdge + 1));
    for (int i = 0; i < kBlockEdge; ++i) sums[kBlockEdge * row + i] += in[i];
  }
}

/// For a kernel of any reach: the rows of eight voxels that a point may reach.
void addPointsToRows(const LocalPoint* points, std::size_t count, float reach, float inverse_reach2,
                     float* sums) {
  const auto first = [reach](float c) { return c > reach ? static_cast<int>(c - reach) : 0; };
  const auto last = [reach](float c) {
    return c + reach < kBlockEdge - 1 ? static_cast<int>(c + reach) : kBlockEdge - 1;
  };
  for (std::size_t p = 0; p < count; ++p) {
    const LocalPoint point = points[p];
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

void addPointsLoop(const LocalPoint* points, std::size_t count, float reach, float* sums) {
  const float inverse_reach2 = 1.0f / (reach * reach);
  if (reach <= 1.0f) {
    addPointsToNearestEight(points, count, inverse_reach2, sums);
  } else {
    addPointsToRows(points, count, reach, inverse_reach2, sums);
  }
}

}  // namespace
}  // namespace bki_mapping
