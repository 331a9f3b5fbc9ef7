/// @file Beams without a return.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace bki_mapping::ros_interface {

/// The direction of a beam without a return, as given by the infinite coordinates of its point.
/// @return zero if no coordinate is infinite.
Eigen::Vector3f directionOf(const Eigen::Vector3f& point);

/// Directions of the NaN points of an organised cloud, estimated as the mean azimuth of the returns in the
/// same column and the mean elevation of those in the same row. Skips points whose column or row has no
/// return.
/// @param points row by row. @param width points per row.
std::vector<Eigen::Vector3f> directionsOfHoles(const std::vector<Eigen::Vector3f>& points, std::size_t width);

}  // namespace bki_mapping::ros_interface
