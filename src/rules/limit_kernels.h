/// @file The loops of the scan's rules over the sums of a block, compiled for each instruction set.
#pragma once

#include <cstdint>
#include <string>

#include "bki_mapping/map/block.h"

namespace bki_mapping {

/// The loops for one instruction set. All instruction sets give the same bits.
struct LimitKernels {
  const char* instruction_set;
  /// Of sums >= 0, keeps what exceeds the threshold, and at most `most` of it. The threshold does not apply
  /// to voxels above others whose sums were at least `most` before. What is not a number remains.
  /// @param below which of the 64 voxels below the block reached `most`. @param[in,out] sums 512 of them.
  /// @param[in,out] reached adds the voxels whose sums were at least `most` before, as LayerBits.
  void (*limit)(float threshold, float most, std::uint64_t below, float* sums, std::uint64_t* reached);
  /// Finds sums of at least `least`. @param sums 512 of them. @param layers those that may hold sums other
  /// than 0. @param[in,out] found adds their voxels, as LayerBits.
  void (*find)(const float* sums, Block::Layers layers, float least, std::uint64_t* found);
};

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const LimitKernels& limitKernelsFor(const std::string& instruction_set);

}  // namespace bki_mapping
