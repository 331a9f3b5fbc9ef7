/// @file What the voxels around a voxel say of its state: Equation 12b in docs/method.md, which is not in the
/// paper.
#pragma once

#include <cstdint>
#include <vector>

#include "bki_mapping/core/types.h"
#include "rules/state_kernels.h"

namespace bki_mapping {

/// Sums of votes around a voxel.
struct VoteSums {
  std::int64_t kept = 0, cleared = 0;
  std::int64_t keeping = 0;  ///< number of voxels that their own evidence keeps
};

/// Whether the voxels around keep a voxel that its own evidence keeps, too.
inline bool areKept(const StateRules& rules, const VoteSums& sums) {
  return static_cast<double>(sums.kept) >=
         static_cast<double>(rules.neighbourhoodRatio()) * static_cast<double>(sums.cleared);
}

/// Whether they keep a doubtful one (BlockVotes): its vote must be near the mean of theirs.
inline bool isRestored(const StateRules& rules, EvidenceUnits vote, const VoteSums& sums) {
  constexpr int kShare = 4;  // of the mean, a quarter
  return areKept(rules, sums) && kShare * vote * sums.keeping >= sums.kept;
}

/// Whether they keep one that is hidden or grazed (Fate), although its own evidence does not. @param sums of
/// what is here and of what has left, by the looks: twice as much must be here.
inline bool isStillThere(const StateRules& rules, const VoteSums& sums) {
  return sums.kept > 0 && areKept(rules, {sums.kept, 2 * sums.cleared});
}

/// Whether any voxel of the block may ask its neighbourhood.
bool mayAskNeighbourhood(const StateRules& rules, const Block& block);

/// Finds the voxels of a block that are overruled. @param unsure hidden and grazed voxels (Fate), which may
/// ask whether what is around is still there. @return false if none asks its neighbourhood.
bool findOverruled(const StateKernels& kernels, const SemanticMap& map, const StateRules& rules,
                   const BlockIndex& index, const Block& block, const Look::Voxels& unsure,
                   Overruled& overruled);

/// The blocks, and all others of the map whose states depend on them. @param blocks that have
/// changed.
std::vector<GridIndex> withDependents(const SemanticMap& map, const StateRules& rules,
                                      Span<const GridIndex> blocks);

}  // namespace bki_mapping
