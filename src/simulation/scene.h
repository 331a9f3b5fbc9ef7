/// @file A world of simple shapes, some of which move.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace bki_mapping::simulation {

enum class ShapeType { kBox, kCylinder, kEllipsoid };

/// One shape. Moves with constant velocity; boxes are turned about the vertical.
struct Shape {
  ShapeType type = ShapeType::kBox;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< at time 0, world frame [m]
  /// Half extents [m]; a cylinder stands upright with radius half.x() = half.y(), an ellipsoid has these as
  /// its semi-axes.
  Eigen::Vector3d half = Eigen::Vector3d::Ones();
  double yaw = 0.0;                                    ///< of boxes [rad]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  std::uint32_t label = 0;                             ///< raw SemanticKITTI number

  Eigen::Vector3d centreAt(double time) const { return centre + time * velocity; }
  bool moves() const { return !velocity.isZero(); }
  bool contains(const Eigen::Vector3d& point, double time) const;
  /// Distance along a ray to its first point on the surface, seen from outside; none if it misses.
  /// @param direction unit vector.
  std::optional<double> hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double time) const;
};

/// The ground is the plane z = 0; its label depends on |y|: it is a street along x.
struct Ground {
  double road_half_width = 5.0;      ///< [m]
  double sidewalk_half_width = 8.0;  ///< [m]
  std::uint32_t road = 40, sidewalk = 48, terrain = 72;
  std::uint32_t labelAt(double y) const;
};

struct Scene {
  Ground ground;
  std::vector<Shape> shapes;

  /// Ground truth: what is at a point; none for free space. Below z = 0 is ground.
  std::optional<std::uint32_t> labelAt(const Eigen::Vector3d& point, double time) const;
};

/// A street along x with buildings, fences, trees, poles, signs, parked and moving cars and pedestrians.
/// @param length of the street from x = -30 m [m]. @param seed of its random parts; same seed, same street.
Scene makeStreet(double length, std::uint64_t seed);

}  // namespace bki_mapping::simulation
