/// @file The rules by which the sums of a scan become evidence of the map.
#pragma once

#include <limits>

#include "update/block_sums.h"

namespace bki_mapping {

/// What a scan may add to a voxel. They hold for the scan as a whole, whatever its evidence is made of.
struct UpdateRules {
  bool hits_before_misses = false;      ///< a voxel that holds a hit takes no evidence for `free`
  bool evidence_before_misses = false;  ///< nor does one to which a hit adds
  float most_hits = std::numeric_limits<float>::infinity();  ///< to all classes together
  float most_free = std::numeric_limits<float>::infinity();

  bool protectsVoxels() const { return hits_before_misses || evidence_before_misses; }
};

/// Applies the rules to the hits of one block: limits their sums, each class giving up the same fraction.
/// @param[out] is_protected voxels that take no evidence for `free` from this scan.
void applyToHits(const UpdateRules& rules, BlockSums& hits, VoxelMask& is_protected);

/// Applies the rules to the free space of one block.
void applyToFree(const UpdateRules& rules, const VoxelMask& is_protected, BlockSums& free);

}  // namespace bki_mapping
