/// @file Settings of how the state of a voxel is decided.
#pragma once

namespace bki_mapping {

/// Gains on the evidence for `free` when the state of a voxel is decided, by its likeliest class; 1 is the
/// posterior's own verdict. Voxels of the unlabelled class have 1.
struct FreeGainConfig {
  double dynamic_classes = 1.0;  ///< classes flagged dynamic
  double static_classes = 1.0;   ///< the others
  /// A gain g above 1 falls with the evidence from hits, to 1 + (g - 1) exp(-hits / persistence); 0: never.
  double persistence = 0.0;
};

}  // namespace bki_mapping
