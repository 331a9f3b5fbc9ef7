/// @file Limiting and searching the sums of a block, over the vocabulary of simd/vec.h.
#pragma once

#include "bki_mapping/map/block.h"
#include "rules/limit_kernels.h"

namespace bki_mapping {
namespace {

inline void limitSums(float threshold, float most, std::uint64_t below, float* sums, std::uint64_t* reached) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  for (int layer = 0; layer < kBlockEdge; ++layer) {
    std::uint64_t bits = 0;
    for (int v = 0; v < kLayer; v += kLanes) {
      const FloatVec sum = LoadU(sums + v);
      const FloatVec excess = IfThenElse(MaskFromBits(below >> v), sum, sum - threshold);
      const FloatVec positive = IfThenElse(excess < 0.0f, FloatVec{}, excess);
      StoreU(IfThenElse(positive > most, Set(most), positive), sums + v);
      bits |= BitsFromMask(sum >= most) << v;
    }
    reached[layer] |= bits;
    below = bits;
    sums += kLayer;
  }
}

inline void findSums(const float* sums, Block::Layers layers, float least, std::uint64_t* found) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  for (int layer = layers.begin; layer < layers.end; ++layer) {
    std::uint64_t bits = 0;
    for (int v = 0; v < kLayer; v += kLanes) {
      bits |= BitsFromMask(LoadU(sums + layer * kLayer + v) >= least) << v;
    }
    found[layer] |= bits;
  }
}

constexpr LimitKernels kLimitKernels = {kInstructionSet, limitSums, findSums};

}  // namespace
}  // namespace bki_mapping
