/// @file The named parameters of SensorModelConfig.
#pragma once

#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/core/scan.h"

namespace bki_mapping {

inline std::vector<NamedParameter<SensorModelConfig>> sensorModelParameters() {
  using C = SensorModelConfig;
  return {
      realParameter("min_range", &C::min_range, NumberRange::atLeast(0.0).slider(0.0, 1000.0), "m",
                    Changes::kWhileMapping,
                    "Hits closer to the sensor than this are dropped. Set it to leave out the robot itself."),
      realParameter(
          "max_range", &C::max_range, NumberRange::above(0.0).orElse(-1.0, "not known").slider(-1.0, 1000.0),
          "m", Changes::kWhileMapping,
          "Hits beyond this range do not occupy voxels. Set it to the range that the sensor measures "
          "reliably; with -1, points beyond " +
              numberText(SensorModelConfig::kFarthest) + " m are dropped as faults of the driver."),
  };
}

}  // namespace bki_mapping
