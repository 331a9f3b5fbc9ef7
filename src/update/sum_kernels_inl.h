/// @file Rounding sums to units and adding these, over the vocabulary of simd/vec.h.
#pragma once

#include "bki_mapping/map/block.h"
#include "update/sum_kernels.h"

namespace bki_mapping {
namespace {

/// Number of lanes in which masks were set. @param minus_count sums of masks, whose lanes are 0 or -1.
inline std::size_t countOf(IntVec minus_count) {
  std::size_t count = 0;
  for (int lane = 0; lane < kLanes; ++lane) count += static_cast<std::size_t>(-minus_count[lane]);
  return count;
}

template <bool kWithdraws>
bool addSums(const float* sums, Block::Layers layers, EvidenceUnits* plane, SumCounts& counts) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  static_assert(kLayer % kLanes == 0);
  constexpr float kMostSum = 0x1.fffffep30f;  // the last float that is an EvidenceUnits
  IntVec any = {}, numbers = {}, saturated = {}, negative = {};
  for (int v = layers.begin * kLayer; v < layers.end * kLayer; v += kLanes) {
    const FloatVec sum = LoadU(sums + v) * (1.0f / kEvidenceUnit);
    const Mask is_number = sum == sum;
    const FloatVec capped = IfThenElse(sum < kMostSum, sum, Set(kMostSum));
    const IntVec whole = ConvertTo<IntVec>(capped);
    const Mask rounds_up = capped - ConvertTo<FloatVec>(whole) >= 0.5f;
    const IntVec units = (whole - rounds_up) & is_number;
    const IntVec before = LoadU(plane + v);
    IntVec after;
    if constexpr (kWithdraws) {
      const IntVec least = units - kMostUnits;
      saturated += before < least;
      after = Max(before, least) - units;
      negative += after < 0;
    } else {
      const IntVec most = kMostUnits - units;
      saturated += before > most;
      after = Min(before, most) + units;
    }
    StoreU(after, plane + v);
    numbers += is_number;
    any |= after;
  }
  const auto all = static_cast<std::size_t>((layers.end - layers.begin) * kLayer);
  counts += {all - countOf(numbers), countOf(saturated), countOf(negative)};
  return AnyTrue(any != 0);
}

inline Block::Layers findLayers(const float* sums, Block::Layers layers) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  const auto isNothing = [&](int layer) {
    Mask some = {};
    for (int v = layer * kLayer; v < (layer + 1) * kLayer; v += kLanes) {
      some |= ~(LoadU(sums + v) < 0.5f * kEvidenceUnit);  // what is no number is something, too
    }
    return !AnyTrue(some);
  };
  while (layers.begin < layers.end && isNothing(layers.begin)) ++layers.begin;
  while (layers.begin < layers.end && isNothing(layers.end - 1)) --layers.end;
  return layers;
}

template <bool kWithdraws>
bool addUnits(const std::uint64_t* voxels, int layers, const EvidenceUnits* units, EvidenceUnits* plane,
              SumCounts& counts) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  IntVec any = {}, saturated = {}, negative = {};
  for (int layer = 0; layer < layers; ++layer, plane += kLayer) {
    if (voxels[layer] == 0) continue;
    for (int v = 0; v < kLayer; v += kLanes) {
      const Mask chosen = MaskFromBits(voxels[layer] >> v);
      const IntVec change = LoadU(units + v) & chosen;  // the others change by 0
      const IntVec before = LoadU(plane + v);
      IntVec after;
      if constexpr (kWithdraws) {
        negative += (before >= 0) & (before < change);
        after = Max(before, change - kMostUnits) - change;
      } else {
        const IntVec most = kMostUnits - change;
        saturated += (before > most) & (before < kMostUnits);
        after = Min(before, most) + change;
      }
      StoreU(after, plane + v);
      any |= after & chosen;
    }
  }
  counts += {0, countOf(saturated), countOf(negative)};
  return AnyTrue(any != 0);
}

constexpr SumKernels kSumKernels = {
    kInstructionSet, addSums<false>, addSums<true>, findLayers, addUnits<false>, addUnits<true>,
};

}  // namespace
}  // namespace bki_mapping
