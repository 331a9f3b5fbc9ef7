/// @file What one scan may add to the map, in units of evidence; src/rules/apply_scan_rules.h applies it.
#pragma once

#include <cmath>
#include <limits>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/types.h"
#include "bki_mapping/rules/rules_config.h"

namespace bki_mapping {

/// What one scan may add to a voxel: Equations 3a, 14 and 14a in docs/method.md, and which evidence for
/// `free` counts. The paper has none of these rules; by default none applies. They apply to the whole scan,
/// whatever kind its evidence is.
struct ScanRules {
  ScanRules() = default;
  /// The rules that these settings ask for. Some members are missing: `fixed` follows from the class table,
  /// thin_reach also from the resolution, void_margin from its setting and the resolution, and each scan has
  /// a free_threshold for itself.
  explicit ScanRules(const RulesConfig& rules) {
    if (!rules.enabled) return;
    hits_before_misses = rules.has(Rule::kHitsFirst);
    static_spread = !rules.has(Rule::kHitsStay);
    if (rules.has(Rule::kHitLimit)) most_hits = static_cast<float>(RulesConfig::kHit);
    most_free = static_cast<float>(RulesConfig::kCrossing);
    void_evidence = static_cast<float>(rules.emptiness());
    keeps_looks = rules.latest;
  }

  /// A voxel that contains a hit, or to which a hit adds evidence, takes no evidence for `free`.
  bool hits_before_misses = false;
  /// Hits of classes that cannot move add evidence to all voxels within the kernel, as other hits do;
  /// otherwise all of it to the voxel that contains them.
  bool static_spread = true;
  /// For all classes together; larger sums are scaled down.
  float most_hits = std::numeric_limits<float>::infinity();
  /// For `free`; larger sums are cut off.
  float most_free = std::numeric_limits<float>::infinity();
  /// Of evidence for `free`, only what exceeds this counts, before most_free limits it, unless that of the
  /// voxel below reaches most_free.
  float free_threshold = 0.0f;
  /// Added to `free` in voxels that are seen empty with all around them (VoidSearch); needs most_free. 0:
  /// they count as others do.
  float void_evidence = 0.0f;
  /// A hit above a voxel that is seen empty counts as one of something thin: no voxel up to this far away
  /// from its voxel along each axis is void; at most kMostReach [voxels]. 0: such hits are as others.
  int thin_reach = 0;
  /// No voxel up to this far away along each axis from one that contains a hit and takes evidence from hits
  /// of what can move or has no label is void; at most kMostReach [voxels].
  int void_margin = 0;
  static constexpr int kMostReach = kBlockEdge - 1;
  bool keeps_looks = false;  ///< note when the scan looked at which voxels (Looks)
  ClassSet fixed;            ///< the classes that cannot move

  /// Whether it matters which voxels contain hits.
  bool asksForHits() const { return hits_before_misses || void_evidence > 0.0f; }
  /// Whether the threshold depends on the voxel below.
  bool asksBelow() const { return free_threshold > 0.0f && std::isfinite(most_free); }
  /// More evidence for `free` than this makes no difference.
  float enoughFree() const { return free_threshold + most_free; }
  bool seeksVoids() const { return void_evidence > 0.0f || keeps_looks; }
};

}  // namespace bki_mapping
