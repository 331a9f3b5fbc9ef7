#include "ros/no_returns.h"

#include <cmath>

namespace bki_mapping::ros_interface {

Eigen::Vector3f directionOf(const Eigen::Vector3f& point) {
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isinf(point[axis])) direction[axis] = point[axis] > 0.0f ? 1.0f : -1.0f;
  }
  return direction;
}

std::vector<Eigen::Vector3f> directionsOfHoles(const std::vector<Eigen::Vector3f>& points,
                                               std::size_t width) {
  const std::size_t height = width > 0 ? points.size() / width : 0;
  std::vector<Eigen::Vector2f> azimuth(width, Eigen::Vector2f::Zero());     // sums of (cos, sin)
  std::vector<Eigen::Vector2f> elevation(height, Eigen::Vector2f::Zero());  // the same
  for (std::size_t i = 0; i < width * height; ++i) {
    const float flat = points[i].head<2>().norm();
    if (!points[i].allFinite() || !(flat > 0.0f)) continue;
    azimuth[i % width] += points[i].head<2>() / flat;
    elevation[i / width] += Eigen::Vector2f(flat, points[i].z()).normalized();
  }
  std::vector<Eigen::Vector3f> directions;
  for (std::size_t i = 0; i < width * height; ++i) {
    const Eigen::Vector2f& a = azimuth[i % width];
    const Eigen::Vector2f& e = elevation[i / width];
    if (!points[i].hasNaN() || !(a.norm() > 0.0f) || !(e.norm() > 0.0f)) continue;
    const Eigen::Vector2f around = a.normalized(), up = e.normalized();
    directions.emplace_back(around.x() * up.x(), around.y() * up.x(), up.y());
  }
  return directions;
}

}  // namespace bki_mapping::ros_interface
