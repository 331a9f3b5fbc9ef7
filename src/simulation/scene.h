/// @file A scene of simple static and moving shapes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace bki_mapping::simulation {

enum class ShapeType { kBox, kCylinder, kEllipsoid };

/// A shape that moves with constant velocity. Boxes may be rotated about the vertical axis.
struct Shape {
  ShapeType type = ShapeType::kBox;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< at time 0, world frame [m]
  /// Half extents [m]: an upright cylinder has the radius half.x() = half.y(), an ellipsoid has these
  /// semi-axes.
  Eigen::Vector3d half = Eigen::Vector3d::Ones();
  double yaw = 0.0;                                    ///< of boxes [rad]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  std::uint32_t label = 0;                             ///< raw SemanticKITTI label

  Eigen::Vector3d centreAt(double time) const { return centre + time * velocity; }
  bool moves() const { return !velocity.isZero(); }
  bool contains(const Eigen::Vector3d& point, double time) const;
  /// Distance along a ray to the surface [m]; nullopt if the ray misses, or starts inside of the shape.
  /// @param direction unit vector.
  std::optional<double> hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double time) const;
};

/// The plane z = 0 with a road along x: the label depends on |y|.
struct Ground {
  double road_half_width = 5.0;      ///< [m]
  double sidewalk_half_width = 8.0;  ///< [m]
  std::uint32_t road = 40, sidewalk = 48, terrain = 72;
  std::uint32_t labelAt(double y) const;
};

struct Scene {
  Ground ground;
  std::vector<Shape> shapes;

  /// Ground truth: the label at a point; nullopt for free space. Everything below z = 0 is ground.
  std::optional<std::uint32_t> labelAt(const Eigen::Vector3d& point, double time) const;
};

/// A street along x with buildings, fences, trees, poles, signs, parked and moving cars and pedestrians.
/// @param length of the street, which begins at x = -30 m [m]. @param seed equal seeds give equal streets.
Scene makeStreet(double length, std::uint64_t seed);

}  // namespace bki_mapping::simulation
