/// @file Applies ScanRules to the sums of a scan before they enter the map. (Limits of blocks and memory:
/// UpdateLimits in update/map_updater.h.)
#pragma once

#include <cstdint>

#include "bki_mapping/rules/scan_rules.h"
#include "rules/block_sums.h"
#include "rules/limit_kernels.h"
#include "rules/void_search.h"

namespace bki_mapping {

/// Evidence for `free` at the top and bottom of a block, where the threshold depends on a block of another
/// group.
struct BlockSeam {
  std::uint64_t reached_top = 0;  ///< voxels of the top layer whose evidence reaches most_free
  std::uint64_t held_back = 0;    ///< voxels of the bottom layer from which the threshold may have taken some
  float* sums = nullptr;  ///< of the 64 voxels of the bottom layer, before limits; valid where held back
};

/// Applies the rules to the hits of one block. Sums above the limit are scaled by one factor for all classes.
/// @param[out] is_protected adds the voxels that take no evidence for `free` from this scan.
void applyToHits(const ScanRules& rules, const LimitKernels& kernels, BlockSums& hits,
                 VoxelMask& is_protected);

/// Applies the rules to the free space of one block. @param below which of the 64 voxels below the block
/// reached most_free. @param[out] seam for a block above another group, whose voxels are not known yet: what
/// the threshold has taken; nullptr for others. @return the block's voxels whose evidence reaches most_free,
/// whether or not it exceeds the threshold, if voids are sought or the threshold needs them.
VoxelMask applyToFree(const ScanRules& rules, const LimitKernels& kernels, const VoxelMask& is_protected,
                      std::uint64_t below, BlockSums& free, BlockSeam* seam);

/// ScanRules::free_threshold of a scan: the most that a beam which ends on level ground adds to a voxel whose
/// centre is in the ground. @param peak, length [m] of the kernel. @param height of the sensor above the
/// ground [m].
double groundThreshold(double peak, double length, double height);

/// A sum >= 0 in units, rounded as kernels round sums; larger ones count as the largest.
EvidenceUnits roundedUnits(float sum);

/// The units that the threshold has taken from a sum >= 0 of a voxel, but would not above a crossed one.
EvidenceUnits heldBack(const ScanRules& rules, float sum);

/// Notes what the hits of one block say of its voxels. @param hits with those that contain a hit.
/// @param[out] hit voxels to which hits add evidence.
void noteHits(const ScanRules& rules, const LimitKernels& kernels, const BlockSums& hits, SeenVoxels& seen,
              VoxelMask& hit);

}  // namespace bki_mapping
