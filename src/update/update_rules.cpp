#include "update/update_rules.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace bki_mapping {
namespace {

void limitHits(float most, BlockSums& hits) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  alignas(64) float kept[kBlockVoxels] = {};  // the sum over all classes, then the fraction to keep
  for (const BlockSums::Plane& plane : hits) {
    const int end = plane.layers.end * kLayer;
    for (int v = plane.layers.begin * kLayer; v < end; ++v) kept[v] += plane.values[v];
  }
  for (float& each : kept) each = each > most ? most / each : 1.0f;
  for (BlockSums::Plane& plane : hits) {
    const int end = plane.layers.end * kLayer;
    for (int v = plane.layers.begin * kLayer; v < end; ++v) plane.values[v] *= kept[v];
  }
}

/// The voxels with sums of at least `least`, which is above 0.
VoxelMask atLeast(float least, const BlockSums::Plane& plane) {
  constexpr int kLayer = kBlockEdge * kBlockEdge, kByte = 8;
  LayerBits bits = {};
  for (int layer = plane.layers.begin; layer < plane.layers.end; ++layer) {
    const float* const values = plane.values + layer * kLayer;
    std::uint8_t is[kLayer];
    for (int v = 0; v < kLayer; ++v) is[v] = values[v] >= least;
    for (int v = 0; v < kLayer; v += kByte) {
      std::uint64_t eight;  // bytes of 0 or 1; the product has the n-th of them in bit 56 + n
      std::memcpy(&eight, is + v, sizeof(eight));
      bits[static_cast<std::size_t>(layer)] |= eight * 0x0102040810204080 >> 56 << v;
    }
  }
  return maskOf(bits);
}

/// Sets the values of some of 64 voxels to 0.
void clear(std::uint64_t voxels, float* values) {
  if (voxels == ~std::uint64_t{0}) {
    std::fill_n(values, 64, 0.0f);
    return;
  }
  for (; voxels != 0; voxels &= voxels - 1) values[__builtin_ctzll(voxels)] = 0.0f;
}

}  // namespace

void applyToHits(const UpdateRules& rules, BlockSums& hits, VoxelMask& is_protected) {
  if (rules.hits_before_misses) is_protected |= hits.occupied;
  if (rules.evidence_before_misses) {
    for (const BlockSums::Plane& plane : hits) {
      is_protected |= atLeast(std::numeric_limits<float>::denorm_min(), plane);
    }
  }
  if (std::isfinite(rules.most_hits)) limitHits(rules.most_hits, hits);
}

void applyToFree(const UpdateRules& rules, const VoxelMask& is_protected, BlockSums& free) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  const float threshold = rules.free_threshold, most = rules.most_free;
  const LayerBits cleared = bitsOf(is_protected);
  for (BlockSums::Plane& plane : free) {
    for (int layer = 0; layer < kBlockEdge; ++layer) {
      clear(cleared[static_cast<std::size_t>(layer)], plane.values + layer * kLayer);
    }
    if (threshold > 0.0f) {
      for (float& value : plane.values) {
        value = std::min(std::max(value - threshold, 0.0f), most);
      }
    } else if (std::isfinite(most)) {
      for (float& value : plane.values) value = std::min(value, most);
    }
  }
}

void noteHits(const UpdateRules& rules, const BlockSums& hits, SeenVoxels& seen, VoxelMask& hit) {
  VoxelMask may_move;
  for (const BlockSums::Plane& plane : hits) {
    (rules.fixed[plane.label] ? seen.fixed : may_move) |= atLeast(std::numeric_limits<float>::min(), plane);
  }
  hit = seen.fixed | may_move;
  seen.fixed &= ~may_move;
  seen.moving = may_move;
}

void noteFree(const UpdateRules& rules, const BlockSums& free, const VoxelMask& hit, SeenVoxels& seen) {
  for (const BlockSums::Plane& plane : free) seen.crossed = atLeast(rules.most_free, plane) & ~hit;
}

}  // namespace bki_mapping
