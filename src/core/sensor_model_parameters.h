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
      realParameter(
          "height", &C::height, NumberRange::atLeast(0.01).upTo(1000.0).orElse(0.0, "found from the ground"),
          "m", Changes::kWhileMapping,
          "Height of the sensor above the ground, on which it depends how little a beam that ends on "
          "the ground clears of the voxels in it. With 0, each scan finds it from its hits of classes with "
          "the flag ground within 20 m; where there are none, such voxels may become free. Set it if the "
          "class table flags no ground. Used with rules/enabled."),
  };
}

}  // namespace bki_mapping
