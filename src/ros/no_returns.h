/// @file Beams without a return.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace bki_mapping::ros_shell {

/// The direction of a beam without a return from its own coordinates: towards its infinite ones.
/// @return zero if none is infinite.
Eigen::Vector3f directionOf(const Eigen::Vector3f& point);

/// Directions of the points that are NaN in an organised cloud, from their neighbours: the mean azimuth of
/// the returns in the same column, the mean elevation of those in the same row. Points whose column or row
/// has no return are left out.
/// @param points row by row. @param width points a row.
std::vector<Eigen::Vector3f> directionsOfHoles(const std::vector<Eigen::Vector3f>& points, std::size_t width);

}  // namespace bki_mapping::ros_shell
