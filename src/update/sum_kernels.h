/// @file The loop that adds sums to a plane of evidence, compiled for each instruction set.
#pragma once

#include <cstddef>
#include <string>

#include "bki_mapping/map/block.h"

namespace bki_mapping {

/// Numbers of voxels whose sum could not be added exactly.
struct SumCounts {
  std::size_t not_finite = 0;  ///< the sum is not a number, and was left out
  std::size_t saturated = 0;   ///< the evidence saturated
  std::size_t negative = 0;    ///< more was withdrawn than had been added

  SumCounts& operator+=(const SumCounts& other) {
    not_finite += other.not_finite;
    saturated += other.saturated;
    negative += other.negative;
    return *this;
  }
};

/// The loop for one instruction set.
struct SumKernels {
  const char* instruction_set;
  /// Rounds sums to the nearest unit, halves up, and adds them to a plane, or subtracts them. Evidence
  /// saturates at kMostUnits and -kMostUnits. All instruction sets give the same bits.
  /// @param sums 512 of them, >= 0. @param layers those that may hold sums other than 0.
  /// @param[in,out] counts increased. @return whether any evidence in those layers is not 0.
  bool (*add)(const float* sums, Block::Layers layers, EvidenceUnits* plane, SumCounts& counts);
  bool (*withdraw)(const float* sums, Block::Layers layers, EvidenceUnits* plane, SumCounts& counts);
};

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const SumKernels& sumKernelsFor(const std::string& instruction_set);

}  // namespace bki_mapping
