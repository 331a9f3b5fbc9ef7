/// @file The rules that are applied to the sums of a scan before they enter the map. (Limits of blocks and
/// memory: UpdateLimits in update/map_updater.h.)
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/scan_limit_config.h"
#include "rules/block_sums.h"
#include "rules/limit_kernels.h"
#include "rules/void_search.h"

namespace bki_mapping {

/// What one scan may add to a voxel: Equations 14 and 14a in docs/method.md, and which evidence for `free`
/// counts. The paper has none of these rules; by default none applies. They apply to the whole scan, whatever
/// kind its evidence is.
struct ScanRules {
  ScanRules() = default;
  ScanRules(const ScanLimitConfig& config, const ClassTable& classes);

  /// A voxel that contains a hit, or to which a hit adds evidence, takes no evidence for `free`.
  bool hits_before_misses = false;
  float most_hits = std::numeric_limits<float>::infinity();  ///< for all classes together
  float most_free = std::numeric_limits<float>::infinity();
  /// Of evidence for `free`, only what exceeds this counts, before most_free limits it, unless that of the
  /// voxel below reaches most_free.
  float free_threshold = 0.0f;
  float void_evidence = 0.0f;  ///< added to `free` in void voxels (VoidSearch); 0: they count as others do
  bool keeps_looks = false;    ///< note when the scan looked at which voxels (Looks)
  ClassSet fixed;              ///< the classes that cannot move

  /// Whether the threshold depends on the voxel below.
  bool asksBelow() const { return free_threshold > 0.0f && std::isfinite(most_free); }
  /// More evidence for `free` than this makes no difference.
  float enoughFree() const { return free_threshold + most_free; }
  bool seeksVoids() const { return void_evidence > 0.0f || keeps_looks; }
};

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

/// A sum >= 0 in units, rounded as kernels round sums; larger ones count as the largest.
EvidenceUnits roundedUnits(float sum);

/// The units that the threshold has taken from a sum >= 0 of a voxel, but would not above a crossed one.
EvidenceUnits heldBack(const ScanRules& rules, float sum);

/// Notes what the hits of one block say of its voxels. @param hits with those that contain a hit.
/// @param[out] hit voxels to which hits add evidence.
void noteHits(const ScanRules& rules, const LimitKernels& kernels, const BlockSums& hits, SeenVoxels& seen,
              VoxelMask& hit);

}  // namespace bki_mapping
