/// @file The loops that add the sums of a block to a plane of evidence, compiled for each instruction set.
#pragma once

#include <cstddef>
#include <cstdint>
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

/// The loops for one instruction set. All instruction sets give the same bits.
struct SumKernels {
  const char* instruction_set;
  /// Rounds sums to the nearest unit, halves up, and adds them to a plane, or subtracts them. Evidence
  /// saturates at kMostUnits and -kMostUnits, and counts each time it does.
  /// @param sums 512 of them, >= 0. @param layers those that may hold sums other than 0.
  /// @param[in,out] counts increased. @return whether any evidence in those layers is not 0.
  bool (*add)(const float* sums, Block::Layers layers, EvidenceUnits* plane, SumCounts& counts);
  bool (*withdraw)(const float* sums, Block::Layers layers, EvidenceUnits* plane, SumCounts& counts);
  /// Finds the layers that add() changes a plane in, or counts something in, and those between them.
  /// @param sums, layers as for add().
  Block::Layers (*find_layers)(const float* sums, Block::Layers layers);
  /// Adds units to some voxels of the layers of a plane, or subtracts them; saturates likewise.
  /// @param voxels, layers a word for each of so many layers, as LayerBits. @param units 64 of them, >= 0,
  /// the same for each layer. @param[in,out] counts increased; what was saturated or negative before does not
  /// count again, nor does saturation at -kMostUnits. @return whether any evidence in those voxels is not 0.
  bool (*add_units)(const std::uint64_t* voxels, int layers, const EvidenceUnits* units, EvidenceUnits* plane,
                    SumCounts& counts);
  bool (*withdraw_units)(const std::uint64_t* voxels, int layers, const EvidenceUnits* units,
                         EvidenceUnits* plane, SumCounts& counts);
};

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const SumKernels& sumKernelsFor(const std::string& instruction_set);

}  // namespace bki_mapping
