#include "update/update_rules.h"

#include <algorithm>
#include <cmath>

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
    if (std::isfinite(rules.most_free)) {
      for (float& value : plane.values) value = std::min(value, rules.most_free);
    }
  }
}

}  // namespace bki_mapping
