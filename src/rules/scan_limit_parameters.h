/// @file The named parameters of ScanLimitConfig.
#pragma once

#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/rules/scan_limit_config.h"

namespace bki_mapping {

/// Those below `scan_limit/`.
inline std::vector<NamedParameter<ScanLimitConfig>> scanLimitParameters() {
  using C = ScanLimitConfig;
  return {
      integerParameter(
          "blocks", &C::blocks, NumberRange::atLeast(0).upTo(1e9), Changes::kWhileMapping,
          "Largest number of blocks of 8 x 8 x 8 voxels that the hits of one scan, or its free space, may "
          "touch; a larger scan is refused. Lower it to protect memory; 0 allows the blocks "
          "within the sensor's reach, at most " +
              std::to_string(ScanLimitConfig::kMostBlocks) + "."),
  };
}

}  // namespace bki_mapping
