#include "update/update_rules.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
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
VoxelMask atLeast(float least, const BlockSums::Plane& plane, const SumKernels& kernels) {
  LayerBits bits = {};
  kernels.find(plane.values, plane.layers, least, bits.data());
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

/// Rounded as kernels round them.
EvidenceUnits roundedUnits(float sum) {
  constexpr float kMostSum = 0x1.fffffep14f;  // the last float whose units are EvidenceUnits
  return unitsOf(static_cast<double>(std::min(sum, kMostSum)));
}

/// Notes what the threshold takes from the bottom layer of a block. @param before, after limits were applied.
void holdBack(float most, const float* before, const float* after, BlockSeam& seam) {
  for (int v = 0; v < kBlockEdge * kBlockEdge; ++v) {
    const float all = std::min(before[v], most);
    if (!(all > after[v])) continue;
    seam.units[v] = roundedUnits(all) - roundedUnits(after[v]);
    seam.held_back |= std::uint64_t{seam.units[v] > 0} << v;
  }
}

}  // namespace

void applyToHits(const UpdateRules& rules, const SumKernels& kernels, BlockSums& hits,
                 VoxelMask& is_protected) {
  if (rules.hits_before_misses) is_protected |= hits.occupied;
  if (rules.evidence_before_misses) {
    for (const BlockSums::Plane& plane : hits) {
      is_protected |= atLeast(std::numeric_limits<float>::denorm_min(), plane, kernels);
    }
  }
  if (std::isfinite(rules.most_hits)) limitHits(rules.most_hits, hits);
}

VoxelMask applyToFree(const UpdateRules& rules, const SumKernels& kernels, const VoxelMask& is_protected,
                      BlockSums& free, BlockSeam* seam) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  const bool limits = rules.free_threshold > 0.0f || std::isfinite(rules.most_free) || rules.seeksVoids();
  const LayerBits cleared = bitsOf(is_protected);
  LayerBits reached = {};
  for (BlockSums::Plane& plane : free) {
    for (int layer = 0; layer < kBlockEdge; ++layer) {
      clear(cleared[static_cast<std::size_t>(layer)], plane.values + layer * kLayer);
    }
    if (!limits) continue;
    float bottom[kLayer];
    if (rules.asksBelow()) std::copy_n(plane.values, kLayer, bottom);
    kernels.limit(rules.free_threshold, rules.most_free, plane.values, reached.data());
    if (rules.asksBelow()) holdBack(rules.most_free, bottom, plane.values, *seam);
  }
  if (rules.asksBelow()) seam->crossed_top = reached[kBlockEdge - 1];
  return maskOf(reached);
}

void noteHits(const UpdateRules& rules, const SumKernels& kernels, const BlockSums& hits, SeenVoxels& seen,
              VoxelMask& hit) {
  VoxelMask may_move;
  for (const BlockSums::Plane& plane : hits) {
    (rules.fixed[plane.label] ? seen.fixed : may_move) |=
        atLeast(std::numeric_limits<float>::min(), plane, kernels);
  }
  hit = seen.fixed | may_move;
  seen.fixed &= ~may_move;
  seen.moving = may_move;
}

}  // namespace bki_mapping
