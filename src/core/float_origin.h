/// @file Positions as 32-bit floats: where these are precise enough, and to which origin they are given
/// elsewhere.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace bki_mapping {

/// The distance between adjacent float32 numbers at a coordinate [m].
inline double floatSpacing(double coordinate) {
  const float at = std::abs(static_cast<float>(coordinate));
  return static_cast<double>(std::nextafter(at, std::numeric_limits<float>::infinity()) - at);
}

/// Whether float32 is too coarse for voxels at a place [m]: rounding may move them by more than a tenth of
/// their edge.
inline bool tooFarForFloats(const Eigen::Vector3d& place, double resolution) {
  return 0.5 * floatSpacing(place.cwiseAbs().maxCoeff()) > 0.1 * resolution;
}

/// Edge of a voxel that is as small as those of most maps, for points of which no map is known [m].
constexpr double kFineVoxel = 0.1;

/// The origin [m] to which float32 positions near a place are given: zero or, where float32 is too coarse for
/// that, the place in whole kilometres, which float32 holds exactly.
inline Eigen::Vector3d floatOrigin(const Eigen::Vector3d& place, double resolution) {
  if (!tooFarForFloats(place, resolution)) return Eigen::Vector3d::Zero();
  constexpr double kStep = 1000.0;
  return place.unaryExpr([](double metres) { return kStep * std::round(metres / kStep) + 0.0; });
}

}  // namespace bki_mapping
