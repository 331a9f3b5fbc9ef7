/// @file The rules that are applied to the sums of a scan before they enter the map. (Limits of blocks and
/// memory: UpdateLimits in map_updater.h.)
#pragma once

#include <limits>

#include "update/block_sums.h"

namespace bki_mapping {

/// What one scan may add to a voxel. The rules apply to the whole scan, whatever kind its evidence is.
struct UpdateRules {
  bool hits_before_misses = false;      ///< a voxel that contains a hit takes no evidence for `free`
  bool evidence_before_misses = false;  ///< nor does a voxel to which a hit adds evidence
  float most_hits = std::numeric_limits<float>::infinity();  ///< for all classes together
  float most_free = std::numeric_limits<float>::infinity();

  bool protectsVoxels() const { return hits_before_misses || evidence_before_misses; }
};

/// Applies the rules to the hits of one block. Sums above the limit are scaled by one factor for all classes.
/// @param[out] is_protected adds the voxels that take no evidence for `free` from this scan.
void applyToHits(const UpdateRules& rules, BlockSums& hits, VoxelMask& is_protected);

/// Applies the rules to the free space of one block.
void applyToFree(const UpdateRules& rules, const VoxelMask& is_protected, BlockSums& free);

}  // namespace bki_mapping
