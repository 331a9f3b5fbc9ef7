/// @file The loops that read a block, compiled for each instruction set.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "bki_mapping/map/map_query.h"

namespace bki_mapping {

/// The planes of a block, and what else the posterior of its voxels depends on.
struct BlockPlanes {
  struct Plane {
    const EvidenceUnits* units;
    ClassId id;
    float gain;   ///< on the evidence for `free` in voxels whose likeliest class this is, before it decays
    bool decays;  ///< whether the gain depends on the evidence for the class
    bool fixed;   ///< whether the class cannot move, and so may remain by (12a)
  };

  const SemanticMap* map;
  std::array<Plane, kMaxClasses> planes;  ///< of classes, by rising id; the first `count`
  std::size_t count = 0;
  const EvidenceUnits* free = nullptr;  ///< zeros if the block has no plane for `free`
  bool has_free = false;
};

/// The loops for one instruction set: they set all fields of the view that they are named for, and state
/// kUnknown also where the block has an occlusion mark.
struct ViewKernels {
  using Read = void (*)(const BlockPlanes& planes, BlockView& view);

  const char* instruction_set;
  Read states;     ///< state and label
  Read posterior;  ///< all but entropy
  Read all;
};

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const ViewKernels& viewKernelsFor(const std::string& instruction_set);

/// readBlock with the given loops.
void readBlock(const ViewKernels& kernels, const SemanticMap& map, const Block& block, BlockFields fields,
               BlockView& view);

// Scalar parts, which all instruction sets share, so that they decide alike:

/// Whether a voxel with evidence is occupied: Equation 11 in docs/method.md, decided on whole units.
bool isOccupied(EvidenceUnits best, float gain, EvidenceUnits free);
/// log2 of the share that (12a) asks of what remains: a quarter of the evidence of what has left.
constexpr int kRemainingShift = 2;
/// SemanticMap::freeGain, compiled for any processor.
float decayedGain(const SemanticMap& map, ClassId id, float hits);

}  // namespace bki_mapping
