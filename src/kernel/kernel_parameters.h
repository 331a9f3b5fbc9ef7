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
          "position. Only its ratio to prior matters. Keep it far from both ends of the range of evidence, "
          "1.5e-5 to 32768. With rules/enabled it has no effect: scans are counted."),
  };
}

}  // namespace bki_mapping
