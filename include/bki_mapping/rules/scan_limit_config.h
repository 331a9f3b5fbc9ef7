/// @file What one scan may add to the map, in units of evidence; rules/scan_rules.h has the rules.
#pragma once

#include <cstdint>

#include "bki_mapping/rules/rules_config.h"

namespace bki_mapping {

/// What one scan may add to a voxel; by default all of it, as in the paper. With RulesConfig::enabled, all
/// but `blocks` follows from RulesConfig (limitsOf) and, for free_threshold, from the scan.
struct ScanLimitConfig {
  /// Whether a voxel that contains a hit, or to which a hit adds evidence, takes no evidence for `free` from
  /// its scan.
  bool hits_before_misses = false;
  /// Whether hits of classes that cannot move add evidence to all voxels within the kernel, as other hits do,
  /// or all of it to the voxel that contains them.
  bool static_spread = true;
  // The largest evidence that a scan adds; 0: no limit.
  double hits = 0.0;  ///< for all classes together; larger sums are scaled down
  double free = 0.0;  ///< for `free`; larger sums are cut off
  /// Evidence for `free` that one scan must exceed in a voxel: only the excess counts, and is limited. It
  /// does not apply where the evidence of the voxel below reaches `free`.
  double free_threshold = 0.0;
  /// Further evidence for `free` where a voxel and its 18 neighbours are all seen, and all empty but for
  /// classes that cannot move, and for voxels that hits of the others only reach; needs `free`. 0: none.
  double void_space = 0.0;
  /// Largest number of blocks that the hits of a scan, or its free space, may touch; 0: the number within the
  /// sensor's reach, at most kMostBlocks. A larger scan is refused.
  std::int64_t blocks = 0;

  /// Whether it matters which voxels contain hits.
  bool asksForHits() const { return hits_before_misses || void_space > 0.0; }

  static constexpr std::int64_t kMostBlocks = 1 << 18;  ///< 0.5 GB for each class that they all hold
};

/// The limits that rules set; free_threshold is 0, because each scan has its own.
ScanLimitConfig limitsOf(const RulesConfig& rules);
/// ScanLimitConfig::free_threshold of a scan: the most that a beam which ends on level ground adds to a voxel
/// whose centre is in the ground. @param peak of the kernel. @param height of the sensor above the ground
/// [m].
double groundThreshold(double peak, double length, double height);

}  // namespace bki_mapping
