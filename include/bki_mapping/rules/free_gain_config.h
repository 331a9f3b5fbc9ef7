/// @file Settings of what a voxel is; rules/state_rules.h has the rules. The paper has none of them, and by
/// default none applies.
#pragma once

namespace bki_mapping {

/// Gains on the evidence for `free` when the state of a voxel is decided, by its class with the most
/// evidence. With a gain of 1 the state follows the posterior; the unlabelled class always has 1.
struct FreeGainConfig {
  double dynamic_classes = 1.0;  ///< classes flagged dynamic
  double living_classes = 0.0;   ///< of these, those flagged living; 0: as dynamic_classes
  double static_classes = 1.0;   ///< all other classes

  double ofLiving() const { return living_classes > 0.0 ? living_classes : dynamic_classes; }

  /// Evidence of hits over which a gain g > 1 decays, to 1 + (g - 1) exp(-hits / persistence); 0: never.
  /// Eight times it is the most that a voxel counts for in `neighbourhood`.
  double persistence = 0.0;

  /// Where something movable has left, the likeliest class that cannot move still occupies a voxel if its
  /// evidence is at least this factor times that for free, and a quarter of that for what has left; 0: never.
  double remaining = 0.0;

  /// Least ratio of kept to cleared evidence in the neighbourhood of an occupied voxel (Equation 12b), where
  /// the likeliest class is flagged dynamic, but not living; 0: each voxel decides by itself. Of voxels up to
  /// two away whose class is such, too, the evidence is kept where the voxel by itself is occupied, and
  /// cleared elsewhere. A cleared voxel stays free if it has less than a quarter of the mean evidence of the
  /// kept ones, or less than a twentieth of its evidence for free. If no class is flagged dynamic, all but
  /// the unlabelled one count, and no voxel below.
  double neighbourhood = 0.0;

  /// Whether what the latest scans saw of a voxel decides its state, where that is clear, and not the sum.
  bool latest = false;
};

}  // namespace bki_mapping
