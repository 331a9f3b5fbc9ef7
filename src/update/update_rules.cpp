#include "update/update_rules.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bki_mapping {
namespace {

void limitHits(float most, BlockSums& hits) {
  alignas(64) float kept[kBlockVoxels] = {};  // the sum over all classes, then the fraction to keep
  for (const BlockSums::Plane& plane : hits) {
    for (int v = 0; v < kBlockVoxels; ++v) kept[v] += plane.values[v];
  }
  for (float& each : kept) each = each > most ? most / each : 1.0f;
  for (BlockSums::Plane& plane : hits) {
    for (int v = 0; v < kBlockVoxels; ++v) plane.values[v] *= kept[v];
  }
}

/// The voxels with sums of at least `least`.
VoxelMask atLeast(float least, const BlockSums::Plane& plane) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  VoxelMask mask;
  for (int layer = 0; layer < kBlockEdge; ++layer) {
    const float* const values = plane.values + layer * kLayer;
    int count = 0;  // most layers have none or all, which vectors find out
    for (int v = 0; v < kLayer; ++v) count += values[v] >= least;
    if (count == 0) continue;
    std::uint64_t bits = ~std::uint64_t{0};
    if (count < kLayer) {
      bits = 0;
      for (int v = 0; v < kLayer; ++v) bits |= std::uint64_t{values[v] >= least} << v;
    }
    mask |= VoxelMask(bits) << static_cast<std::size_t>(layer * kLayer);
  }
  return mask;
}

}  // namespace

void applyToHits(const UpdateRules& rules, BlockSums& hits, VoxelMask& is_protected) {
  if (rules.hits_before_misses) is_protected |= hits.occupied;
  if (rules.evidence_before_misses) {
    for (const BlockSums::Plane& plane : hits) {
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        if (plane.values[v] > 0.0f) is_protected.set(v);
      }
    }
  }
  if (std::isfinite(rules.most_hits)) limitHits(rules.most_hits, hits);
}

void applyToFree(const UpdateRules& rules, const VoxelMask& is_protected, BlockSums& free) {
  for (BlockSums::Plane& plane : free) {
    if (is_protected.any()) {
      for (std::size_t v = 0; v < kBlockVoxels; ++v)
        plane.values[v] = is_protected[v] ? 0.0f : plane.values[v];
    }
    if (rules.free_threshold > 0.0f) {
      for (float& value : plane.values) value = std::max(value - rules.free_threshold, 0.0f);
    }
    if (std::isfinite(rules.most_free)) {
      for (float& value : plane.values) value = std::min(value, rules.most_free);
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
}

void noteFree(const UpdateRules& rules, const BlockSums& free, const VoxelMask& hit, SeenVoxels& seen) {
  for (const BlockSums::Plane& plane : free) seen.crossed = atLeast(rules.most_free, plane) & ~hit;
}

}  // namespace bki_mapping
