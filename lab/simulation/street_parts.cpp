#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

void addMoving(Shape shape, const Motion& motion, std::uint32_t label, std::vector<Shape>& shapes) {
  shape.velocity = motion.velocity;
  shape.legs = motion.legs;
  if (motion.moves()) shape.label = label;
  shapes.push_back(std::move(shape));
}

}  // namespace

Motion Motion::inTurns(double speed, double go, double stand, double begin, double end) {
  Motion motion;
  for (double at = begin; at < end; at += go + stand) {
    if (at + go > 0.0) motion.legs.push_back({at + go, {speed, 0.0, 0.0}});
    if (at + go + stand > 0.0) motion.legs.push_back({at + go + stand, Eigen::Vector3d::Zero()});
  }
  return motion;
}

Motion Motion::drivingOff(double start, double speed, double to) {
  constexpr double kPullOut = 2.5;  // [s]
  Motion motion = constant(speed);
  motion.legs = {{start, Eigen::Vector3d::Zero()}, {start + kPullOut, {0.5 * speed, to / kPullOut, 0.0}}};
  return motion;
}

Motion Motion::visiting(double arrival, double departure, double speed, double aside) {
  const double turn = aside == 0.0 ? 0.0 : 2.5;  // [s]
  const Eigen::Vector3d along(speed, 0.0, 0.0), into(0.5 * speed, turn == 0.0 ? 0.0 : aside / turn, 0.0);
  Motion motion = constant(speed);
  motion.legs = {{arrival - turn, along},
                 {arrival, into},
                 {departure, Eigen::Vector3d::Zero()},
                 {departure + turn, {into.x(), -into.y(), 0.0}}};
  return motion;
}

Motion Motion::sitting(double arrival, double departure, double speed, double down) {
  constexpr double kBefore = 1.0, kSinking = 0.5;  // [s]
  const Eigen::Vector3d along(speed, 0.0, 0.0), sink(0.0, 0.0, -down / kSinking);
  Motion motion = constant(speed);
  motion.legs = {{arrival, along},
                 {arrival + kBefore, Eigen::Vector3d::Zero()},
                 {arrival + kBefore + kSinking, sink},
                 {departure - kSinking, Eigen::Vector3d::Zero()},
                 {departure, -sink}};
  return motion;
}

Motion Motion::sliding(double way, double closed, double open, double end) {
  Motion motion;
  double at = 0.0;
  const auto leg = [&](double duration, double speed) {
    motion.legs.push_back({at += duration, {speed, 0.0, 0.0}});
  };
  while (at < end) {
    leg(closed, 0.0);
    leg(1.0, way);
    leg(open, 0.0);
    leg(1.0, -way);
  }
  return motion;
}

Eigen::Vector3d Motion::wayUntil(double time) const {
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  double begin = 0.0;
  for (const Leg& leg : legs) {
    if (leg.until > time) break;
    way += (leg.until - begin) * leg.velocity;
    begin = leg.until;
  }
  return way;
}

Shape box(double x, double y, double z, double length, double width, double height, std::uint32_t label) {
  Shape shape{ShapeType::kBox, {x, y, z}, {length / 2, width / 2, height / 2}};
  shape.label = label;
  return shape;
}

Shape pillar(double x, double y, double radius, double height, std::uint32_t label) {
  Shape shape{ShapeType::kCylinder, {x, y, height / 2}, {radius, radius, height / 2}};
  shape.label = label;
  return shape;
}

void addCar(double x, double y, const Motion& motion, std::vector<Shape>& shapes) {
  addMoving(box(x, y, 0.65, 4.3, 1.8, 0.8, kCar), motion, kMovingCar, shapes);
  addMoving(box(x - 0.2, y, 1.25, 2.2, 1.6, 0.5, kCar), motion, kMovingCar, shapes);
}

void addPedestrian(double x, double y, const Motion& motion, std::vector<Shape>& shapes) {
  addMoving(pillar(x, y, 0.28, 1.75, kPerson), motion, kMovingPerson, shapes);
}

void addGate(double x, double y, const Motion& motion, std::vector<Shape>& shapes) {
  addMoving(box(x, y, 1.0, 2.4, 0.1, 2.0, kMovingVehicle), motion, kMovingVehicle, shapes);
  for (const double side : {-1.35, 1.35}) shapes.push_back(pillar(x + side, y, 0.1, 2.2, kPole));
}

void addTrolley(double x, double y, const Motion& motion, std::vector<Shape>& shapes) {
  addMoving(box(x, y, 0.55, 0.8, 0.6, 1.1, kMovingVehicle), motion, kMovingVehicle, shapes);
}

void addBicycle(double x, double y, const Motion& motion, std::vector<Shape>& shapes) {
  addMoving(box(x, y, 0.5, 1.7, 0.4, 1.0, kBicycle), motion, kMovingBicyclist, shapes);
  if (motion.moves()) addMoving(pillar(x, y, 0.25, 1.8, kPerson), motion, kMovingBicyclist, shapes);
}

void addTree(double x, double y, Dice& dice, std::vector<Shape>& shapes) {
  const double height = dice.between(2.0, 3.0), crown = dice.between(1.2, 2.0);
  shapes.push_back(pillar(x, y, 0.2, height, kTrunk));
  Shape leaves{ShapeType::kEllipsoid, {x, y, height + 0.8 * crown}, {crown, crown, 1.2 * crown}};
  leaves.label = kVegetation;
  shapes.push_back(leaves);
}

void addLampPost(double x, double side, std::vector<Shape>& shapes) {
  shapes.push_back(pillar(x, side * 5.6, 0.1, 5.0, kPole));
}

void addSign(double x, double side, std::vector<Shape>& shapes) {
  shapes.push_back(pillar(x, side * 5.9, 0.05, 2.2, kPole));
  shapes.push_back(box(x, side * 5.9, 2.5, 0.06, 0.7, 0.7, kSign));
}

void addHouses(double begin, double end, double side, Dice& dice, std::vector<Shape>& shapes) {
  for (double x = begin; x < end;) {
    const double width = dice.between(9.0, 18.0), gap = dice.between(3.0, 7.0),
                 depth = dice.between(7.0, 10.0);
    const double front = side * dice.between(11.0, 14.0), height = dice.between(4.0, 9.0);
    shapes.push_back(
        box(x + width / 2, front + side * depth / 2, height / 2, width, depth, height, kBuilding));
    const bool hedge = dice.between(0.0, 1.0) < 0.5;
    shapes.push_back(box(x + width + gap / 2, side * 10.0, hedge ? 0.7 : 0.6, gap, hedge ? 0.8 : 0.1,
                         hedge ? 1.4 : 1.2, hedge ? kVegetation : kFence));
    x += width + gap;
  }
}

}  // namespace bki_mapping::simulation
