/// @file The kernel's parameters by name.
#pragma once

#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/kernel/kernel_config.h"

namespace bki_mapping {

inline std::vector<NamedParameter<KernelConfig>> kernelParameters() {
  using C = KernelConfig;
  return {
      choiceParameter("type", &C::type, {"sparse", "counting"}, Changes::kAtStart,
                      "How a point adds evidence: sparse spreads it over the voxels around the point, less "
                      "with distance; counting adds 1 to the voxel that contains the point."),
      realParameter(
          "length", &C::length, NumberRange::atLeast(0.0), "m", Changes::kAtStart,
          "Support radius l of the sparse kernel: a point adds evidence to voxels whose centres are "
          "closer than this. Set 0 to use the resolution."),
      realParameter(
          "scale", &C::scale, NumberRange::atLeast(0.001).upTo(1000.0), "", Changes::kAtStart,
          "Value sigma0 of the sparse kernel at distance 0: the evidence that a hit adds at its own "
          "position. Only its ratio to prior and to scan_limit matters. Keep it far from both ends of the "
          "range of evidence, 1.5e-5 to 32768."),
      truthParameter(
          "static_spread", &C::static_spread, Changes::kWhileMapping,
          "Let hits of classes that cannot move (those neither dynamic nor unlabelled) add evidence to all "
          "voxels within kernel/length, as other hits do. Set false to let each add all of its evidence to "
          "the voxel that contains it, so that floors and walls look no thicker than they are; "
          "downsample_resolution should then divide resolution without a remainder."),
  };
}

}  // namespace bki_mapping
