/// @file What the voxels around a voxel say of its state: Equation 12b in docs/method.md.
#pragma once

#include <cstdint>
#include <vector>

#include "bki_mapping/core/types.h"
#include "map/view_kernels.h"

namespace bki_mapping {

/// The voxels that are asked: those of a cube about the voxel, this far from it along each axis; without
/// SemanticMap::neighbourhoodIsBelow, none of the layers below it.
constexpr int kNeighbourhoodReach = 2;

/// Sums of votes around a voxel.
struct VoteSums {
  std::int64_t kept = 0, cleared = 0;
  std::int64_t keeping = 0;  ///< number of voxels that their own evidence keeps
};

/// Whether the voxels around keep a voxel that its own evidence keeps, too.
inline bool areKept(const SemanticMap& map, const VoteSums& sums) {
  return static_cast<double>(sums.kept) >=
         static_cast<double>(map.neighbourhoodRatio()) * static_cast<double>(sums.cleared);
}

/// Whether they keep a doubtful one (BlockVotes): its vote must be near the mean of theirs.
inline bool isRestored(const SemanticMap& map, EvidenceUnits vote, const VoteSums& sums) {
  constexpr int kShare = 4;  // of the mean, a quarter
  return areKept(map, sums) && kShare * vote * sums.keeping >= sums.kept;
}

/// Whether any voxel of the block may ask its neighbourhood.
bool mayAskNeighbourhood(const SemanticMap& map, const Block& block);

/// Finds the voxels of a block that are overruled. @return false if none asks its neighbourhood.
bool findOverruled(const ViewKernels& kernels, const SemanticMap& map, const BlockIndex& index,
                   const Block& block, Overruled& overruled);

/// The blocks, and all others of the map whose states depend on their evidence. @param blocks that have
/// changed.
std::vector<GridIndex> withDependents(const SemanticMap& map, Span<const GridIndex> blocks);

}  // namespace bki_mapping
