#include "simulation/street_along.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "bki_mapping/core/named_parameter.h"
#include "core/pi.h"
#include "simulation/oncoming.h"
#include "simulation/plots.h"
#include "simulation/street_parts.h"
#include "simulation/way.h"

namespace bki_mapping::simulation {
namespace {

constexpr double kToAxis = 1.5;       ///< from the axis of the street to the way of the sensor [m]
constexpr double kParked = 4.2;       ///< from the axis to the middle of parked cars [m]
constexpr double kMostAhead = 120.0;  ///< by which the street is longer than the way at both ends [m]

std::vector<Eigen::Vector3d> positionsOf(const DriveConfig& config) {
  std::vector<Eigen::Vector3d> positions;
  for (const Eigen::Isometry3d& pose : config.trajectory) positions.push_back(pose.translation());
  return positions;
}

std::shared_ptr<const Relief> reliefUnder(const std::vector<Eigen::Vector3d>& positions, const Way& way,
                                          double height) {
  std::vector<Eigen::Vector3d> below = positions;
  for (Eigen::Vector3d& point : below) point.z() -= height;
  std::vector<Eigen::Vector2d> axis;
  for (double s = way.begin(); s <= way.end(); s += 1.0) axis.push_back(way.at(s).beside(kToAxis));
  auto relief = std::make_shared<const Relief>(below, axis);
  constexpr double kLeast = 0.3;  // [m]
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double over = positions[i].z() - relief->heightAt(positions[i].x(), positions[i].y());
    if (over >= std::min(kLeast, 0.5 * height)) continue;
    throw std::invalid_argument("pose " + std::to_string(i) + " of the trajectory would be " +
                                numberText(std::round(100.0 * over) / 100.0) +
                                " m above the ground, because other passes of the same place are higher; "
                                "correct its heights, or give a "
                                "greater height of the sensor");
  }
  return relief;
}

/// For each metre of the way from its beginning on: whether the sensor has not come through this street
/// before, in either direction.
std::vector<bool> firstPasses(const Way& way) {
  constexpr double kSameStreet = 8.0, kLater = 40.0;  // [m]
  std::vector<bool> first;
  std::vector<WayPoint> points;
  PlaneIndex index(kSameStreet);
  for (double s = way.begin(); s <= way.end(); s += 1.0) {
    const WayPoint here = way.at(s);
    bool is_first = true;
    index.forEachNear(here.position, kSameStreet, [&](std::uint32_t i) {
      const double along = std::abs(std::cos(points[i].heading - here.heading));
      const bool later = static_cast<double>(points.size() - i) > kLater;
      if (later && along > 0.85 && (points[i].position - here.position).norm() < kSameStreet)
        is_first = false;
    });
    index.add(static_cast<std::uint32_t>(points.size()), here.position);
    points.push_back(here);
    first.push_back(is_first);
  }
  return first;
}

/// Points of the way of the sensor, and of the road before its start and after its end.
std::vector<Eigen::Vector3d> keptFree(const std::vector<Eigen::Vector3d>& positions, const Way& way) {
  constexpr double kStep = 0.25;
  std::vector<Eigen::Vector3d> points = pointsAlong(positions, kStep);
  const auto add = [&](double from, double to) {
    for (double s = from; s < to; s += kStep) {
      const Eigen::Vector2d at = way.at(s).position;
      points.emplace_back(at.x(), at.y(), 0.0);
    }
  };
  add(way.begin(), 0.0);
  add(way.lengthAt(positions.size() - 1), way.end());
  return points;
}

/// Places what street_parts makes, for a street along x, into a street along a way.
class StreetBuilder {
 public:
  StreetBuilder(const std::vector<Eigen::Vector3d>& positions, const Way& way, Scene& scene)
      : way_(way), first_(firstPasses(way)), plots_(keptFree(positions, way)), scene_(scene) {}

  const Plots& plots() const { return plots_; }

  /// Whether a street is laid out at a length of the way.
  bool isNew(double s) const { return first_[static_cast<std::size_t>(s - way_.begin())]; }

  /// Adds shapes if their place is free. @param s length of the way at their x = 0. @param shapes y = 0 is
  /// the axis of the street. @param from_way, gap least distances to the way of the sensor, and to what
  /// stands [m]. @return whether they are added.
  bool add(double s, std::vector<Shape> shapes, double from_way, double gap) {
    const WayPoint here = way_.at(s);
    const Eigen::Vector2d origin = here.beside(kToAxis);
    const Eigen::Rotation2Dd turn(here.heading);
    Eigen::AlignedBox2d bounds;
    for (const Shape& shape : shapes) {
      const Eigen::Vector2d half = shape.half.head<2>();
      const auto extend = [&](const Eigen::Vector3d& at) {
        bounds.extend(Eigen::Vector2d(at.head<2>() - half)).extend(Eigen::Vector2d(at.head<2>() + half));
      };
      extend(shape.centre);
      for (const Leg& leg : shape.legs) extend(shape.centreAt(leg.until));
    }
    const Footprint place{origin + turn * bounds.center(), 0.5 * bounds.sizes(), here.heading};
    if (!plots_.isFree(place, from_way, gap)) return false;
    plots_.take(place);
    const double ground = heightAt(place.centre);
    double lowest = ground;
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        const Eigen::Vector2d corner = place.half.cwiseProduct(Eigen::Vector2d(x, y));
        lowest = std::min(lowest, heightAt(place.centre + turn * corner));
      }
    }
    for (Shape& shape : shapes) {
      shape.yaw += here.heading;
      shape.centre.head<2>() = origin + turn * shape.centre.head<2>();
      if (shape.legs.empty()) {
        settle(shape, ground, lowest);
      } else {
        walk(shape, turn);
      }
      scene_.shapes.push_back(std::move(shape));
    }
    return true;
  }

 private:
  double heightAt(const Eigen::Vector2d& at) const { return scene_.ground.heightAt(at.x(), at.y()); }

  /// Puts a shape on the ground. What stands on the ground reaches down to it at each of its corners.
  static void settle(Shape& shape, double ground, double lowest) {
    const bool stands = shape.centre.z() <= shape.half.z();
    const double deeper = stands ? ground - lowest + 0.1 : 0.0;
    shape.half.z() += 0.5 * deeper;
    shape.centre.z() += ground - 0.5 * deeper;
  }
  /// Turns the legs of a shape into the street, and lets them follow the ground.
  void walk(Shape& shape, const Eigen::Rotation2Dd& turn) const {
    shape.centre.z() += heightAt(shape.centre.head<2>());
    Eigen::Vector2d at = shape.centre.head<2>();
    double begin = 0.0;
    for (Leg& leg : shape.legs) {
      const double duration = leg.until - begin;
      leg.velocity.head<2>() = turn * leg.velocity.head<2>();
      const Eigen::Vector2d to = at + duration * leg.velocity.head<2>();
      leg.velocity.z() = (heightAt(to) - heightAt(at)) / duration;
      at = to;
      begin = leg.until;
    }
  }

  const Way& way_;
  std::vector<bool> first_;
  Plots plots_;
  Scene& scene_;
};

/// Calls visit(s) along the way at random distances, where a street is laid out.
template <typename Visit>
void forEachPlace(const StreetBuilder& builder, const Way& way, double first, double least, double most,
                  Dice& dice, Visit&& visit) {
  for (double s = way.begin() + first; s < way.end(); s += dice.between(least, most)) {
    if (builder.isNew(s)) visit(s);
  }
}

/// Houses, and hedges or fences between them. Where a house has no room, as in a bend, a smaller one may.
void addHousesAlong(const Way& way, double side, Dice& dice, StreetBuilder& builder) {
  for (double s = way.begin(); s < way.end() - 9.0;) {
    double width = dice.between(9.0, 18.0);
    const double gap = dice.between(3.0, 7.0), depth = dice.between(7.0, 10.0),
                 front = side * dice.between(11.0, 14.0), height = dice.between(4.0, 9.0);
    const bool hedge = dice.between(0.0, 1.0) < 0.5;
    bool built = false;
    for (; !built && width >= 6.0; width -= 3.0) {
      const double middle = std::min(s + 0.5 * width, way.end());
      built = builder.isNew(middle) &&
              builder.add(middle,
                          {box(0.0, front + side * depth / 2, height / 2, width, depth, height, kBuilding)},
                          7.0, 1.0);
    }
    width += 3.0;
    s += built ? width : 3.0;
    if (!built || s + gap >= way.end() || !builder.isNew(s + gap / 2)) continue;
    builder.add(s + gap / 2,
                {box(0.0, side * 10.0, hedge ? 0.7 : 0.6, gap, hedge ? 0.8 : 0.1, hedge ? 1.4 : 1.2,
                     hedge ? kVegetation : kFence)},
                5.0, 0.1);
    s += gap;
  }
}

void addStanding(const Way& way, double side, Dice& dice, StreetBuilder& builder) {
  addHousesAlong(way, side, dice, builder);
  forEachPlace(builder, way, 4.0, 11.0, 17.0, dice, [&](double s) {
    std::vector<Shape> tree;
    addTree(0.0, side * 9.0, dice, tree);
    builder.add(s, std::move(tree), kClearance, 0.1);
  });
  forEachPlace(builder, way, 9.0, 25.0, 25.0, dice, [&](double s) {
    std::vector<Shape> post;
    addLampPost(0.0, side, post);
    builder.add(s, std::move(post), kClearance, 0.2);
  });
  forEachPlace(builder, way, 20.0, 40.0, 40.0, dice, [&](double s) {
    std::vector<Shape> sign;
    addSign(0.0, side, sign);
    builder.add(s, std::move(sign), kClearance, 0.2);
  });
  forEachPlace(builder, way, 2.0, 6.0, 14.0, dice, [&](double s) {
    std::vector<Shape> car;
    addCar(0.0, side * kParked, Motion(), car);
    builder.add(s, std::move(car), kClearance, 0.3);
  });
}

/// People who stand, or walk to and fro on the pavement.
void addPeople(const Way& way, double side, Dice& dice, StreetBuilder& builder) {
  forEachPlace(builder, way, 0.0, 12.0, 25.0, dice, [&](double s) {
    const double y = side * dice.between(6.6, 7.6), speed = dice.between(0.8, 1.6),
                 pace = dice.between(5.0, 12.0);
    const bool stands = dice.between(0.0, 1.0) < 0.3;
    Motion motion;
    if (!stands) motion.legs = {{pace, {speed, 0.0, 0.0}}, {2.0 * pace, {-speed, 0.0, 0.0}}};
    std::vector<Shape> person;
    addPedestrian(0.0, y, motion, person);
    if (!stands) person.front().period = 2.0 * pace;
    builder.add(s, std::move(person), kClearance, 0.2);
  });
}

}  // namespace

Scene makeStreetAlong(const DriveConfig& config) {
  const std::vector<Eigen::Vector3d> positions = positionsOf(config);
  const Way way(positions, std::min(config.lidar.max_range + 10.0, kMostAhead));
  Scene scene;
  scene.ground.relief = reliefUnder(positions, way, config.height);
  StreetBuilder builder(positions, way, scene);
  Dice dice(config.seed);
  for (const double side : {-1.0, 1.0}) {
    addStanding(way, side, dice, builder);
    addPeople(way, side, dice, builder);
  }
  addOncomingCars(positions, way, builder.plots(), config, dice, scene);
  return scene;
}

}  // namespace bki_mapping::simulation
