/// @file The axis about which a lidar spins, and where its beams start, found from its returns.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace bki_mapping::ros_interface {

/// Smallest number of returns more than unknowns that says how well they fit.
constexpr float kLeastFreedom = 16.0f;

/// A return, and its place in an organised cloud. A laser of a spinning lidar makes a ring of beams with one
/// elevation; all lasers together make a firing, a half plane through the axis but for an offset of each
/// laser.
struct GridReturn {
  Eigen::Vector3f point;  ///< relative to the sensor [m]
  std::uint32_t ring, firing;
};

/// The direction of a return as seen from where its beam starts, in the axes of the lidar.
struct RingSight {
  Eigen::Vector2f horizontal;  ///< its length is the cosine of the elevation
  float sine;                  ///< of the elevation
  /// Derivative of `sine` with respect to the unknowns: the tilt of the axis towards its first and second
  /// companion [rad], the height and the radius [m] at which beams start.
  Eigen::Vector4f slope;
};

/// The axis of a lidar. Beams start near the origin: on a circle about the axis, as in a lidar whose optics
/// turn beside it, at some height above the origin.
struct RingAxis {
  Eigen::Matrix3f axes = Eigen::Matrix3f::Identity();  ///< in its rows: two companions, the axis
  float height = 0.0f, radius = 0.0f;                  ///< [m]
  /// Covariance of the unknowns of RingSight::slope for directions with a variance of 1.
  Eigen::Matrix4f covariance = Eigen::Matrix4f::Zero();

  RingSight sightOf(const Eigen::Vector3f& point) const;
  /// The direction, in the frame of the points, that is `direction` in the axes of the lidar.
  Eigen::Vector3f fromAxes(const Eigen::Vector3f& direction) const { return axes.transpose() * direction; }
};

/// How far the points of each ring are from a plane: the least variance of their directions within rings, as
/// a fraction of the next. Near 0 for rings, and not for firings, whose planes differ. Infinity if no ring
/// has enough points.
/// @param axis the normal of the planes.
double flatness(const std::vector<GridReturn>& returns, std::size_t rings, Eigen::Vector3f& axis);

/// The axis for which the elevations within rings differ least: least squares without outliers, from an even
/// choice of the returns. @param start its approximate direction.
/// @return no value if there are too few returns.
std::optional<RingAxis> fitRingAxis(const std::vector<GridReturn>& returns, std::size_t rings,
                                    const Eigen::Vector3f& start);

}  // namespace bki_mapping::ros_interface
