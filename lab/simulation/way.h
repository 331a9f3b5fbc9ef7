/// @file The line that a sensor drives, seen from above.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace bki_mapping::simulation {

/// A place on a line in the plane.
struct WayPoint {
  Eigen::Vector2d position;  ///< [m]
  double heading;            ///< [rad]
  /// A place beside it. @param left > 0: to the left [m].
  Eigen::Vector2d beside(double left) const;
};

/// The way of a sensor, by the length that it has driven, and straight on before its start and after its end.
class Way {
 public:
  /// @param positions of the sensor, at least one. @param ahead by how much the way is longer at both ends
  /// [m].
  Way(const std::vector<Eigen::Vector3d>& positions, double ahead);

  double begin() const { return -ahead_; }                ///< the least length [m]
  double end() const { return driven_.back() + ahead_; }  ///< the greatest length [m]
  /// @param length from begin() to end() [m].
  WayPoint at(double length) const;
  /// The length that has been driven at a position of the sensor; its stand-still adds nothing.
  double lengthAt(std::size_t position) const { return driven_[position]; }

 private:
  Eigen::Vector2d positionAt(double length) const;

  double ahead_;
  std::vector<double> driven_;            ///< for each position of the sensor [m]
  std::vector<double> lengths_;           ///< of the corners, ascending [m]
  std::vector<Eigen::Vector2d> corners_;  ///< at least a metre apart, with both ends
};

/// Points at most `step` apart on the line through positions, seen from above [m].
std::vector<Eigen::Vector3d> pointsAlong(const std::vector<Eigen::Vector3d>& positions, double step);

}  // namespace bki_mapping::simulation
