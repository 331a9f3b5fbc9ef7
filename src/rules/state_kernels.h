/// @file The loops that read a block, compiled for each instruction set.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "bki_mapping/rules/voxel_state.h"

namespace bki_mapping {

/// The voxels of a block whose own evidence is overruled by the voxels around them (12b), or by the latest
/// looks (12c).
using Overruled = std::array<std::int32_t, kBlockVoxels>;
constexpr std::int32_t kNotOverruled = 0, kKept = 1, kCleared = -1;

/// The planes of a block, and what else the posterior of its voxels depends on.
struct BlockPlanes {
  struct Plane {
    const EvidenceUnits* units;
    ClassId id;
    float gain;                         ///< StateRules::freeGain of a voxel without hits
    float standing_gain, stands_after;  ///< StateRules::standingGain, standsAfter
    bool fixed;                         ///< whether the class cannot move, and so may remain by (12a)
    bool asks;  ///< whether voxels whose likeliest class this is ask their neighbourhood (12b)
  };

  const SemanticMap* map;
  const StateRules* rules;
  EvidenceUnits most_vote;                ///< StateRules::mostVote
  std::array<Plane, kMaxClasses> planes;  ///< of classes, by rising id; the first `count`
  std::size_t count = 0;
  const EvidenceUnits* free = nullptr;   ///< zeros if the block has no plane for `free`
  EvidenceUnits most_free = kMostUnits;  ///< that counts for the state: mostFreeOf
  bool has_free = false;
  const Overruled* overruled = nullptr;  ///< nullptr: none is
};

/// What the voxels of a block say to those around that ask (12b) [units, at most StateRules::mostVote]: the
/// evidence for the likeliest class where that asks its neighbourhood, too, and the voxel's own evidence
/// keeps or clears it.
struct BlockVotes {
  alignas(64) std::array<EvidenceUnits, kBlockVoxels> kept, cleared;
  /// Of the cleared ones, those in which hits outweigh a twentieth of the evidence for `free`: they may be
  /// kept.
  alignas(64) std::array<EvidenceUnits, kBlockVoxels> doubtful;
  alignas(64) std::array<std::int32_t, kBlockVoxels> is_kept;  ///< 1 where it is, otherwise 0
};

/// The loops for one instruction set: they set all fields of the view that they are named for, and state
/// kUnknown also where the block has an occlusion mark.
struct StateKernels {
  using Read = void (*)(const BlockPlanes& planes, BlockView& view);

  const char* instruction_set;
  Read states;     ///< state and label
  Read posterior;  ///< all but entropy
  Read all;
  /// Sets the votes of some layers along z. @return whether any voxel of these asks its neighbourhood;
  /// otherwise all these votes are 0.
  bool (*votes)(const BlockPlanes& planes, Block::Layers layers, BlockVotes& votes);
};

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const StateKernels& stateKernelsFor(const std::string& instruction_set);

/// The planes of a block, which the map need not have.
BlockPlanes planesOf(const SemanticMap& map, const StateRules& rules, const Block& block);

/// readBlock with the given loops.
void readBlock(const StateKernels& kernels, const SemanticMap& map, const StateRules& rules,
               const BlockIndex& index, const Block& block, BlockFields fields, BlockView& view);

// Scalar parts, which all instruction sets share, so that they decide alike:

/// Whether a voxel with evidence is occupied: Equation 11 in docs/method.md, decided on whole units.
bool isOccupied(EvidenceUnits best, float gain, EvidenceUnits free);
/// log2 of the share that (12a) asks of what remains: a quarter of the evidence of what has left.
constexpr int kRemainingShift = 2;

}  // namespace bki_mapping
