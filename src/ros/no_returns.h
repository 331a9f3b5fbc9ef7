/// @file Beams without a return.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

namespace bki_mapping::ros_interface {

/// Why the directions of some beams without a return are not known.
enum class NoDirection {
  kUnorganised,  ///< the cloud has no rows and columns
  kNoRings,      ///< its rows and columns are not the rings and firings of a spinning lidar
  kFewReturns,   ///< too few beams of their ring or firing have returned
};

/// The reason as the end of a sentence, with the remedy.
const char* explain(NoDirection reason);

/// What a point says of its beam.
enum class Answer { kReturn, kDirection, kNothing };

/// A point is a return if it is finite and farther than 1 mm from both the origin and the sensor. One with
/// exactly one infinite coordinate, the others finite, is a direction. Others say nothing: signs of several
/// infinite coordinates are those of an octant, and drivers write NaN and zeros for beams without a return.
/// @param sensor where the beams start.
Answer answerOf(const Eigen::Vector3d& point, const Eigen::Vector3d& sensor);

/// The direction that a point with one infinite coordinate gives.
Eigen::Vector3f directionOf(const Eigen::Vector3f& point);

/// The beams of an organised cloud whose points say nothing.
struct Holes {
  std::vector<Eigen::Vector3f> directions;  ///< of each in the order of the points; 0: not known
  /// For each the index of a return of the same firing, which tells its time; its own if the direction is not
  /// known. Drivers need not give a time to points that are no returns.
  std::vector<std::size_t> same_firing;
  std::optional<NoDirection> unknown;  ///< why directions are not known, if some are not
};

/// Estimates the directions of beams without a return from the returns around them. Whether rows or columns
/// are rings, the axis of the lidar, and the offsets of its lasers are found from the returns.
/// @param points in the axes of the cloud's frame, row by row. @param answers what each of them says.
/// @param width points per row. @param sensor where the beams start.
Holes directionsOfHoles(const std::vector<Eigen::Vector3f>& points, const std::vector<Answer>& answers,
                        std::size_t width, const Eigen::Vector3f& sensor);

}  // namespace bki_mapping::ros_interface
