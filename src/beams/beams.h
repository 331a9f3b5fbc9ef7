/// @file The beams of one scan.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace bki_mapping {

/// Straight beams from the sensor to their ends.
struct Beams {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< sensor, map frame [m]
  std::vector<Eigen::Vector3f> ends;                 ///< relative to the sensor, axes of the map frame [m]
};

}  // namespace bki_mapping
