#include "simulation/rooms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/pi.h"
#include "simulation/furniture.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

constexpr double kThickness = 0.12, kDoorWidth = 0.95;  // of walls and of door openings [m]

/// A wall along x or y, with doorways.
/// @param from, to ends along it. @param at its place across. @param doors middles of the doorways along it.
void addWall(bool along_y, double from, double to, double at, const std::vector<double>& doors,
             std::vector<Shape>& shapes) {
  const auto add = [&](double begin, double end, double low, double high, double thickness) {
    const double middle = 0.5 * (begin + end), height = 0.5 * (low + high);
    shapes.push_back(along_y ? box(at, middle, height, thickness, end - begin, high - low, kWall)
                             : box(middle, at, height, end - begin, thickness, high - low, kWall));
  };
  constexpr double kFrame = 0.05, kFrameDepth = kThickness + 0.06;
  double begin = from;
  for (const double door : doors) {
    const double left = door - 0.5 * kDoorWidth, right = door + 0.5 * kDoorWidth;
    add(begin, left, 0.0, kCeiling, kThickness);
    add(left, right, kDoorHeight, kCeiling, kThickness);
    add(left, left + kFrame, 0.0, kDoorHeight, kFrameDepth);
    add(right - kFrame, right, 0.0, kDoorHeight, kFrameDepth);
    add(left, right, kDoorHeight - kFrame, kDoorHeight, kFrameDepth);
    begin = right;
  }
  add(begin, to, 0.0, kCeiling, kThickness);
}

// Of the walls' middles [m].
constexpr double kWest = 0.0, kEast = 14.3, kSouth = -5.3, kNorth = 7.6, kCorridorNorth = 2.45,
                 kOfficeEast = 5.15, kLivingEast = 10.35, kBedroomEast = 7.05;
// Of the doorways [m].
constexpr double kWestDoors = 2.5, kLivingDoor = 8.0, kDiningDoor = 11.5, kSlidingDoor = 12.2,
                 kBetweenNorth = 5.0, kBetweenSouth = -2.8;

void addWalls(std::vector<Shape>& shapes) {
  for (const double y : {kSouth, kNorth}) addWall(false, kWest - 0.06, kEast + 0.06, y, {}, shapes);
  for (const double x : {kWest, kEast}) addWall(true, kSouth, kNorth, x, {}, shapes);
  addWall(false, kWest, kEast, 0.0, {kWestDoors, kDiningDoor}, shapes);
  addWall(false, kWest, kEast, kCorridorNorth, {kWestDoors, kLivingDoor, kSlidingDoor}, shapes);
  addWall(true, kCorridorNorth, kNorth, kOfficeEast, {kBetweenNorth}, shapes);
  addWall(true, kCorridorNorth, kNorth, kLivingEast, {}, shapes);
  addWall(true, kSouth, 0.0, kBedroomEast, {kBetweenSouth}, shapes);
  shapes.push_back(box(0.5 * (kWest + kEast), 0.5 * (kSouth + kNorth), kCeiling + 0.075, kEast - kWest + 0.12,
                       kNorth - kSouth + 0.12, 0.15, kWall));
}

/// Places furniture where the plan has it, a little off.
class Furnisher {
 public:
  Furnisher(Dice& dice, std::vector<Shape>& shapes) : dice_(dice), shapes_(shapes) {}

  void table(double x, double y, double yaw, double length = 1.6, double width = 0.8,
             double height = kTableHeight) {
    addTable(off({x, y, yaw}, 0.03, 0.05), length, width, height, shapes_);
  }
  /// @param yaw of what the chair looks at.
  void chair(double x, double y, double yaw) { addChair(off({x, y, yaw}, 0.06, 0.4), shapes_); }
  void shelves(double x, double y, double yaw, double length) {
    addShelves(off({x, y, yaw}, 0.01, 0.01), length, shapes_);
  }
  void block(double x, double y, double yaw, double length, double width, double height) {
    addBlock(off({x, y, yaw}, 0.02, 0.02), length, width, height, kFurniture, shapes_);
  }
  void sofa(double x, double y, double yaw) { addSofa(off({x, y, yaw}, 0.03, 0.03), shapes_); }
  /// One or two boxes, one upon the other.
  void boxes(double x, double y) {
    const double edge = dice_.between(0.3, 0.45), height = dice_.between(0.2, 0.4);
    const Place place = off({x, y, dice_.between(0.0, 1.5)}, 0.02, 0.0);
    addBlock(place, edge, 0.8 * edge, height, kSmall, shapes_);
    if (dice_.between(0.0, 1.0) < 0.5) return;
    addBlock({place.x, place.y, place.yaw + 0.3}, 0.7 * edge, 0.6 * edge, 0.25, kSmall, shapes_);
    shapes_.back().centre.z() += height;
  }

 private:
  Place off(const Place& place, double shift, double turn) {
    return {place.x + dice_.between(-shift, shift), place.y + dice_.between(-shift, shift),
            place.yaw + dice_.between(-turn, turn)};
  }

  Dice& dice_;
  std::vector<Shape>& shapes_;
};

void furnishNorth(Furnisher& put, std::vector<Shape>& shapes) {
  const double back = kPi;  // looks along -y
  // Office.
  put.table(1.3, 7.05, 0.0);
  put.chair(1.3, 6.4, 0.0);
  put.table(3.9, 7.05, 0.0);
  put.chair(3.9, 6.4, 0.0);
  addHangingCable(3.35, 7.05, kTableHeight, kCeiling, shapes);
  put.block(0.8, 2.82, 0.0, 1.0, 0.5, 1.2);
  put.shelves(4.2, 2.75, 0.0, 0.9);
  put.boxes(4.6, 3.7);
  addLyingCable({3.5, 3.6, 1.1}, 1.4, shapes);
  // Living room.
  put.sofa(6.35, 3.05, 0.0);
  put.table(6.35, 3.95, 0.0, 0.9, 0.5, 0.42);
  addHangingCable(6.35, 3.95, 1.5, kCeiling, shapes);
  addFloorLamp(5.55, 4.0, shapes);
  put.shelves(6.0, 7.3, back, 1.2);
  put.block(8.9, 7.25, back, 1.6, 0.45, 0.55);
  put.boxes(9.95, 6.0);
  put.boxes(9.95, 5.4);
  // Meeting room.
  put.table(12.7, 5.9, 0.0);
  for (const double x : {12.3, 13.1}) {
    put.chair(x, 5.3, 0.0);
    put.chair(x, 6.5, back);
  }
  put.shelves(11.4, 7.3, back, 0.9);
}

void furnishSouth(Furnisher& put, std::vector<Shape>& shapes) {
  const double back = kPi;
  // Dining room.
  put.table(9.3, -1.25, 0.0);
  for (const double x : {8.9, 9.7}) {
    put.chair(x, -0.6, back);
    put.chair(x, -1.9, 0.0);
  }
  put.chair(8.2, -1.25, -0.5 * kPi);
  put.chair(10.4, -1.25, 0.5 * kPi);
  addHangingCable(9.3, -1.25, 1.3, kCeiling, shapes);
  put.table(9.6, -4.7, 0.0);
  for (const double x : {9.2, 10.0}) put.chair(x, -4.05, back);
  put.block(13.5, -4.9, 0.0, 1.2, 0.5, 2.0);
  put.boxes(11.9, -4.95);
  // Bedroom, whose door stands open.
  addBlock({kWestDoors + 0.56, -0.53, 1.4}, 0.88, 0.04, 2.0, kWall, shapes);
  put.block(1.15, -4.4, 0.0, 2.0, 1.4, 0.5);
  put.block(4.6, -4.9, 0.0, 1.8, 0.55, 2.2);
  put.shelves(4.8, -0.28, back, 0.9);
  put.table(0.5, -1.6, -0.5 * kPi, 1.2, 0.6);
  put.chair(1.05, -1.6, 0.5 * kPi);
  put.chair(6.0, -1.2, 2.3);
  put.boxes(0.5, -0.45);
  addLyingCable({4.5, -1.3, 0.4}, 2.0, shapes);
  // Corridor.
  put.block(0.35, 0.6, -0.5 * kPi, 0.8, 0.4, 1.8);
  put.boxes(0.45, 1.95);
  put.boxes(13.85, 0.5);
  addLyingCable({5.6, 1.0, 0.15}, 3.0, shapes);
  addBlock({5.3, 0.45, 0.0}, 0.8, 0.5, 0.95, kTrolley, shapes);
}

/// What something does next.
struct Step {
  double duration;  ///< [s]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double turn = 0.0;  ///< [rad/s]
};

double durationOf(const std::vector<Step>& steps) {
  double sum = 0.0;
  for (const Step& step : steps) sum += step.duration;
  return sum;
}

/// Lets a shape repeat steps that end where they begin.
/// @param phase when in them time 0 is, before anything turns [s].
void repeat(std::vector<Step> steps, double phase, Shape& shape) {
  shape.period = durationOf(steps);
  while (phase > 0.0) {
    const Step step = steps.front();
    const double gone = std::min(phase, step.duration);
    shape.centre += gone * step.velocity;
    steps.push_back({gone, step.velocity, step.turn});
    steps.front().duration -= gone;
    if (gone == step.duration) steps.erase(steps.begin());
    phase -= gone;
  }
  double until = 0.0;
  for (const Step& step : steps) shape.legs.push_back({until += step.duration, step.velocity, step.turn});
}

/// A way to and fro along points, with a rest at both ends.
std::vector<Step> toAndFro(const std::vector<Eigen::Vector2d>& points, double speed, double rest_first,
                           double rest_last) {
  std::vector<Step> steps{{rest_first}};
  const auto go = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    const Eigen::Vector2d way = to - from;
    steps.push_back({way.norm() / speed, {speed * way.normalized().x(), speed * way.normalized().y(), 0.0}});
  };
  for (std::size_t i = 1; i < points.size(); ++i) go(points[i - 1], points[i]);
  steps.push_back({rest_last});
  for (std::size_t i = points.size() - 1; i > 0; --i) go(points[i], points[i - 1]);
  return steps;
}

/// Two legs, a trunk and a head.
std::vector<Shape> personAt(const Eigen::Vector2d& at, std::uint32_t label) {
  std::vector<Shape> parts;
  for (const double side : {-0.1, 0.1}) parts.push_back(pillar(at.x() + side, at.y(), 0.08, 0.85, label));
  Shape trunk{ShapeType::kCylinder, {at.x(), at.y(), 1.15}, {0.21, 0.21, 0.3}};
  Shape head{ShapeType::kEllipsoid, {at.x(), at.y(), 1.6}, {0.1, 0.1, 0.15}};
  trunk.label = head.label = label;
  parts.insert(parts.end(), {trunk, head});
  return parts;
}

/// @param start where the steps begin.
void addWalker(const Eigen::Vector2d& start, const std::vector<Step>& steps, double phase,
               std::vector<Shape>& shapes) {
  for (Shape& part : personAt(start, kMovingPerson)) {
    repeat(steps, phase, part);
    shapes.push_back(std::move(part));
  }
}

/// Somebody who goes from the meeting room to the corridor and back, and a door that opens before and closes
/// behind.
void addDoorUser(Dice& dice, std::vector<Shape>& shapes) {
  const std::vector<Eigen::Vector2d> points{{kSlidingDoor, 4.0}, {kSlidingDoor, 1.75}, {9.3, 1.75}};
  const double speed = dice.between(0.7, 1.1), inside = dice.between(5.0, 8.0),
               outside = dice.between(4.0, 8.0);
  const std::vector<Step> steps = toAndFro(points, speed, inside, outside);
  const double through = steps[1].duration, along = steps[2].duration;
  constexpr double kOpening = 1.0, kWait = 0.3;  // [s]
  const Eigen::Vector3d open(kDoorWidth + 0.05, 0.0, 0.0);
  const std::vector<Step> door_steps{{kWait},
                                     {kOpening, -open / kOpening},
                                     {inside - kWait - 2.0 * kOpening},
                                     {kOpening, open / kOpening},
                                     {through + kWait},
                                     {kOpening, -open / kOpening},
                                     {2.0 * along + outside - kWait - 2.0 * kOpening},
                                     {kOpening, open / kOpening},
                                     {through}};
  const double phase = dice.between(0.0, inside);
  addWalker(points.front(), steps, phase, shapes);
  // It slides in front of the wall, on the side of the corridor, and is open at the start of the steps.
  Shape door = box(kSlidingDoor + open.x(), kCorridorNorth - 0.5 * kThickness - 0.06, 1.03, kDoorWidth, 0.04,
                   2.04, kMovingVehicle);
  repeat(door_steps, phase, door);
  shapes.push_back(door);
}

/// Somebody who goes to the wardrobe in the bedroom, whose door turns about its hinge.
void addWardrobeUser(Dice& dice, std::vector<Shape>& shapes) {
  const double speed = dice.between(0.6, 1.1), away = dice.between(4.0, 8.0), there = dice.between(6.0, 9.0);
  const std::vector<Step> steps = toAndFro({{6.4, -3.9}, {4.25, -3.9}}, speed, away, there);
  constexpr double kOpening = 1.2, kWait = 0.5, kAngle = 1.8, kWidth = 0.55;  // [s], [s], [rad], [m]
  const double phase = dice.between(0.0, away);
  addWalker({6.4, -3.9}, steps, phase, shapes);
  Shape door = box(4.875, -4.56, 1.05, kWidth, 0.03, 2.0, kMovingVehicle);
  door.hinge.x() = 0.5 * kWidth;
  const double way = steps[1].duration;
  repeat({{away + way + kWait},
          {kOpening, Eigen::Vector3d::Zero(), -kAngle / kOpening},
          {there - 2.0 * (kOpening + kWait)},
          {kOpening, Eigen::Vector3d::Zero(), kAngle / kOpening},
          {kWait + way}},
         phase, door);
  shapes.push_back(door);
}

/// People on ways that keep 0.8 m from that of the robot.
void addPeople(Dice& dice, std::vector<Shape>& shapes) {
  addDoorUser(dice, shapes);
  addWardrobeUser(dice, shapes);
  for (const std::vector<Eigen::Vector2d>& points :
       {std::vector<Eigen::Vector2d>{{0.9, 3.7}, {0.9, 5.6}, {1.4, 5.7}},  // office
        {{6.2, 6.5}, {9.4, 6.5}, {9.4, 3.2}},                              // living room
        {{3.6, 1.75}, {6.9, 1.75}},                                        // corridor
        {{13.2, -0.8}, {13.2, -4.0}, {12.4, -4.2}}}) {                     // dining room
    const double speed = dice.between(0.5, 1.2), first = dice.between(3.0, 8.0),
                 last = dice.between(3.0, 8.0);
    const std::vector<Step> steps = toAndFro(points, speed, first, last);
    addWalker(points.front(), steps, dice.between(0.0, durationOf(steps)), shapes);
  }
  for (const Shape& part : personAt({7.75, -4.6}, kPerson)) shapes.push_back(part);
}

// The robot's round: straight from point to point, with rounded corners.
constexpr std::array<std::array<double, 2>, 7> kRound{{{kWestDoors, 0.9},
                                                       {kWestDoors, kBetweenNorth},
                                                       {kLivingDoor, kBetweenNorth},
                                                       {kLivingDoor, 0.85},
                                                       {kDiningDoor, 0.85},
                                                       {kDiningDoor, kBetweenSouth},
                                                       {kWestDoors, kBetweenSouth}}};
constexpr double kCorner = 0.5;  // radius [m]; all corners are right angles

Eigen::Vector2d cornerOf(std::size_t i) {
  const auto& point = kRound[i % kRound.size()];
  return {point[0], point[1]};
}

/// A straight part of the round, and the turn to the next one.
struct Part {
  Eigen::Vector2d start, along;
  double straight, turn;  ///< lengths [m]
  double side;            ///< of the turn: +1 to the left, -1 to the right
};

std::vector<Part> partsOfRound() {
  std::vector<Part> parts;
  for (std::size_t i = 0; i < kRound.size(); ++i) {
    const Eigen::Vector2d from = cornerOf(i), to = cornerOf(i + 1), next = cornerOf(i + 2);
    const Eigen::Vector2d along = (to - from).normalized(), after = (next - to).normalized();
    const double cross = along.x() * after.y() - along.y() * after.x();
    const bool turns = i + 1 < kRound.size();  // the round starts in the middle of a straight part
    const double begin = i == 0 ? 0.0 : kCorner, end = turns ? kCorner : 0.0;
    parts.push_back({from + begin * along, along, (to - from).norm() - begin - end,
                     turns ? kCorner * kPi / 2.0 : 0.0, cross > 0.0 ? 1.0 : -1.0});
  }
  return parts;
}

}  // namespace

Scene makeRooms(std::uint64_t seed) {
  Scene scene;
  scene.ground.road = scene.ground.sidewalk = scene.ground.terrain = kFloor;
  Dice dice(seed);
  addWalls(scene.shapes);
  Furnisher put(dice, scene.shapes);
  furnishNorth(put, scene.shapes);
  furnishSouth(put, scene.shapes);
  addPeople(dice, scene.shapes);
  return scene;
}

double roundThroughRooms() {
  double length = 0.0;
  for (const Part& part : partsOfRound()) length += part.straight + part.turn;
  return length;
}

Eigen::Isometry3d poseInRooms(double way, double height) {
  constexpr double kWeave = 0.04, kWave = 1.1;  // [m], [rad/m]
  double left = std::fmod(way, roundThroughRooms());
  Eigen::Vector2d at = cornerOf(0);
  double heading = 0.0;
  for (const Part& part : partsOfRound()) {
    at = part.start + std::min(left, part.straight) * part.along;
    heading = std::atan2(part.along.y(), part.along.x());
    left -= part.straight;
    if (left <= 0.0) break;
    const double angle = std::min(left, part.turn) / kCorner;
    const Eigen::Vector2d aside = part.side * Eigen::Vector2d(-part.along.y(), part.along.x());
    at += kCorner * (std::sin(angle) * part.along + (1.0 - std::cos(angle)) * aside);
    heading += part.side * angle;
    left -= part.turn;
    if (left <= 0.0) break;
  }
  // It weaves slightly, so that the map's axes are not along the walls.
  at += kWeave * std::sin(kWave * way) * Eigen::Vector2d(-std::sin(heading), std::cos(heading));
  heading += std::atan(kWeave * kWave * std::cos(kWave * way));
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << at, height;
  T.linear() = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

}  // namespace bki_mapping::simulation
