#include "rules/apply_scan_rules.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bki_mapping {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

void limitHits(float most, BlockSums& hits) {
  if (hits.begin() == hits.end()) return;
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  alignas(64) float kept[kBlockVoxels];  // the sum over all classes, then the fraction to keep
  Block::Layers layers = {kBlockEdge, 0};
  for (const BlockSums::Plane& plane : hits) {
    layers = {std::min(layers.begin, plane.layers.begin), std::max(layers.end, plane.layers.end)};
  }
  std::fill(kept + layers.begin * kLayer, kept + layers.end * kLayer, 0.0f);
  for (const BlockSums::Plane& plane : hits) {
    const int end = plane.layers.end * kLayer;
    for (int v = plane.layers.begin * kLayer; v < end; ++v) kept[v] += plane.values[v];
  }
  for (int v = layers.begin * kLayer; v < layers.end * kLayer; ++v) {
    kept[v] = kept[v] > most ? most / kept[v] : 1.0f;
  }
  for (BlockSums::Plane& plane : hits) {
    const int end = plane.layers.end * kLayer;
    for (int v = plane.layers.begin * kLayer; v < end; ++v) plane.values[v] *= kept[v];
  }
}

/// The voxels with sums of at least `least`, which is above 0.
VoxelMask atLeast(float least, const BlockSums::Plane& plane, const LimitKernels& kernels) {
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

/// Notes what the threshold takes from the bottom layer of a block, unless the voxels below are crossed.
void holdBack(const ScanRules& rules, const LimitKernels& kernels, const float* sums, BlockSeam& seam) {
  std::uint64_t some = 0, all = 0;
  kernels.find(sums, {0, 1}, std::numeric_limits<float>::min(), &some);
  // The next float, in case that the sum was rounded down: then nothing is missing from what is in `all`.
  const float enough = std::nextafter(rules.free_threshold + rules.most_free, kInfinity);
  kernels.find(sums, {0, 1}, enough, &all);
  seam.held_back = some & ~all;
  if (seam.held_back != 0) std::copy_n(sums, kBlockEdge * kBlockEdge, seam.sums);
}

}  // namespace

double groundThreshold(double peak, double length, double height) {
  // The maximum of y k(y) over the height y above the ground: beams have the weight y / height there.
  constexpr double kMost = 0.166;
  return kMost * peak * length / height;
}

void applyToHits(const ScanRules& rules, const LimitKernels& kernels, BlockSums& hits,
                 VoxelMask& is_protected) {
  if (rules.hits_before_misses) {
    is_protected |= hits.occupied;
    for (const BlockSums::Plane& plane : hits) {
      is_protected |= atLeast(std::numeric_limits<float>::denorm_min(), plane, kernels);
    }
  }
  if (std::isfinite(rules.most_hits)) limitHits(rules.most_hits, hits);
}

VoxelMask applyToFree(const ScanRules& rules, const LimitKernels& kernels, const VoxelMask& is_protected,
                      std::uint64_t below, BlockSums& free, BlockSeam* seam) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  const bool limits = rules.free_threshold > 0.0f || std::isfinite(rules.most_free) || rules.seeksVoids();
  const LayerBits cleared = bitsOf(is_protected);
  LayerBits reached = {};
  for (BlockSums::Plane& plane : free) {
    for (int layer = 0; layer < kBlockEdge; ++layer) {
      clear(cleared[static_cast<std::size_t>(layer)], plane.values + layer * kLayer);
    }
    if (!limits) continue;
    if (seam) holdBack(rules, kernels, plane.values, *seam);
    kernels.limit(rules.free_threshold, rules.most_free, below, plane.values, reached.data());
  }
  return maskOf(reached);
}

EvidenceUnits roundedUnits(float sum) {
  constexpr float kMostSum = 0x1.fffffep14f;  // the last float whose units are EvidenceUnits
  return static_cast<EvidenceUnits>(static_cast<double>(std::min(sum, kMostSum) / kEvidenceUnit) + 0.5);
}

EvidenceUnits heldBack(const ScanRules& rules, float sum) {
  const float kept = std::min(std::max(sum - rules.free_threshold, 0.0f), rules.most_free);
  return roundedUnits(std::min(sum, rules.most_free)) - roundedUnits(kept);
}

void noteHits(const ScanRules& rules, const LimitKernels& kernels, const BlockSums& hits, SeenVoxels& seen,
              VoxelMask& hit) {
  VoxelMask may_move;
  for (const BlockSums::Plane& plane : hits) {
    (rules.fixed[plane.label] ? seen.bounds : may_move) |=
        atLeast(std::numeric_limits<float>::min(), plane, kernels);
  }
  hit = seen.bounds | may_move;
  seen.moving = may_move & hits.occupied;
  seen.bounds = hit & ~seen.moving;
}

}  // namespace bki_mapping
