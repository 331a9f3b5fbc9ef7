/// @file A scene of simple static and moving shapes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simulation/relief.h"

namespace bki_mapping::simulation {

enum class ShapeType { kBox, kCylinder, kEllipsoid };

/// A leg of a path, with constant velocity.
struct Leg {
  double until = 0.0;                                  ///< when it ends [s]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  double turn = 0.0;                                   ///< of a box about its hinge [rad/s]
};

/// A shape that moves with constant velocity, after other legs if it has some. Boxes may be rotated about the
/// vertical axis.
struct Shape {
  ShapeType type = ShapeType::kBox;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< at time 0, world frame [m]
  /// Half extents [m]: an upright cylinder has the radius half.x() = half.y(), an ellipsoid has these
  /// semi-axes.
  Eigen::Vector3d half = Eigen::Vector3d::Ones();
  double yaw = 0.0;                                    ///< of boxes [rad]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< after the last leg [m/s]
  std::uint32_t label = 0;                             ///< raw SemanticKITTI label
  std::vector<Leg> legs = {};                          ///< by rising time; the first begins at time 0
  /// From the centre at time 0 to the vertical axis about which legs turn the shape, in the world's axes [m].
  Eigen::Vector2d hinge = Eigen::Vector2d::Zero();
  double period = 0.0;  ///< after which the shape is back at its centre and repeats its legs [s]; 0: never
  double appears = -std::numeric_limits<double>::infinity();  ///< from when it is there [s]
  double vanishes = std::numeric_limits<double>::infinity();  ///< until when [s]

  Eigen::Vector3d centreAt(double time) const { return placeAt(time).centre; }
  bool isThereAt(double time) const { return appears <= time && time <= vanishes; }
  /// The shape at rest, for ever, as it is at a time.
  Shape standingAt(double time) const;
  bool contains(const Eigen::Vector3d& point, double time) const;
  /// Distance along a ray to the surface [m]; nullopt if the ray misses, or starts inside of the shape.
  /// @param direction unit vector.
  std::optional<double> hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double time) const;

 private:
  struct Placement {
    Eigen::Vector3d centre;
    double yaw;
  };
  Placement placeAt(double time) const;
};

/// The plane z = 0 with a road along x, whose axis is y = 0, or with a grid of roads along x and y; or a
/// relief with a road along its axis.
struct Ground {
  double road_half_width = 5.0;      ///< [m]
  double sidewalk_half_width = 8.0;  ///< [m]
  std::uint32_t road = 40, sidewalk = 48, terrain = 72;
  int streets = 0;  ///< number of roads in each direction of a grid; 0: one road along x
  double street_distance =
      0.0;  ///< of the axes of parallel roads, of which the first are x = 0 and y = 0 [m]
  std::shared_ptr<const Relief> relief = nullptr;  ///< instead of the plane, if there is one
  std::uint32_t labelAt(double x, double y) const;
  /// [m]; -infinity where a relief has ended.
  double heightAt(double x, double y) const { return relief ? relief->heightAt(x, y) : 0.0; }
  /// Distance along a ray to the ground [m]; nullopt if it does not reach it within the range.
  /// @param direction unit vector.
  std::optional<double> hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double max_range) const;
};

struct Scene {
  Ground ground;
  std::vector<Shape> shapes;

  /// Ground truth: the label at a point; nullopt for free space. Everything below the surface is ground.
  std::optional<std::uint32_t> labelAt(const Eigen::Vector3d& point, double time) const;
  /// The label of the shape that contains a point; nullopt if none does.
  std::optional<std::uint32_t> shapeLabelAt(const Eigen::Vector3d& point, double time) const;
};

/// What moves in a street.
enum class SceneKind {
  kStreet,      ///< cars that pass or are parked, and a few pedestrians
  kTraffic,     ///< stop-and-go traffic in both directions, and parked cars of which some drive off
  kCrowd,       ///< many pedestrians, who walk and stand, and cyclists
  kArrivals,    ///< cars that come, park and leave, people who stop or sit down, trolleys, gates
  kQueue,       ///< cars that creep in both lanes, and parked cars
  kRooms,       ///< no street: furnished rooms along a corridor, people who walk and stand, doors
  kTrajectory,  ///< a street along given poses: makeStreetAlong
};
/// @throws std::invalid_argument if there is no kind of this name.
SceneKind sceneKindNamed(const std::string& name);
/// "street", "traffic", "crowd", "arrivals", "queue", "rooms" or "trajectory".
std::string nameOf(SceneKind kind);

/// A street along x with buildings, fences, trees, poles, signs, and the road users of its kind; or the rooms
/// of makeRooms, which depend on the seed alone.
/// @param length of the street, which begins at x = -30 m [m]. @param duration of the drive [s]. @param speed
/// of the sensor, which drives at y = -1.5 m and is at x = 0 at time 0 [m/s]. @param seed equal arguments
/// give equal streets.
Scene makeScene(SceneKind kind, double length, double duration, double speed, std::uint64_t seed);

}  // namespace bki_mapping::simulation
