#include <cmath>
#include <stdexcept>

#include "parallel/counter_random.h"
#include "simulation/scene.h"

namespace bki_mapping::simulation {
namespace {

// Raw SemanticKITTI labels.
constexpr std::uint32_t kCar = 10, kBicycle = 11, kPerson = 30, kBuilding = 50, kFence = 51, kVegetation = 70,
                        kTrunk = 71, kPole = 80, kSign = 81, kMovingCar = 252, kMovingBicyclist = 253,
                        kMovingPerson = 254;
constexpr double kStart = -30.0;  ///< where the street begins [m]

/// A sequence of random numbers.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : seed_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * counterRandom(seed_, 0, 0, count_++);
  }

 private:
  std::uint64_t seed_, count_ = 0;
};

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

/// How something moves: over legs, and then on with a last velocity.
struct Motion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  std::vector<Leg> legs;

  static Motion constant(double speed) { return {{speed, 0.0, 0.0}, {}}; }
  /// Goes and stands in turn until the end.
  /// @param speed while it goes [m/s]. @param go, stand duration of each [s]. @param begin of the first
  /// cycle, which may lie before time 0 [s].
  static Motion inTurns(double speed, double go, double stand, double begin, double end) {
    Motion motion;
    for (double at = begin; at < end; at += go + stand) {
      if (at + go > 0.0) motion.legs.push_back({at + go, {speed, 0.0, 0.0}});
      if (at + go + stand > 0.0) motion.legs.push_back({at + go + stand, Eigen::Vector3d::Zero()});
    }
    return motion;
  }
  /// Stands, pulls out towards the middle of the street, and drives away along it.
  /// @param to lateral distance of the lane [m].
  static Motion drivingOff(double start, double speed, double to) {
    constexpr double kPullOut = 2.5;  // [s]
    Motion motion = constant(speed);
    motion.legs = {{start, Eigen::Vector3d::Zero()}, {start + kPullOut, {0.5 * speed, to / kPullOut, 0.0}}};
    return motion;
  }
  bool moves() const { return !velocity.isZero() || !legs.empty(); }
};

void addMoving(Shape shape, const Motion& motion, std::uint32_t label, std::vector<Shape>& shapes) {
  shape.velocity = motion.velocity;
  shape.legs = motion.legs;
  if (motion.moves()) shape.label = label;
  shapes.push_back(std::move(shape));
}

/// Body and cabin of a car.
void addCar(double x, double y, const Motion& motion, std::vector<Shape>& shapes) {
  addMoving(box(x, y, 0.65, 4.3, 1.8, 0.8, kCar), motion, kMovingCar, shapes);
  addMoving(box(x - 0.2, y, 1.25, 2.2, 1.6, 0.5, kCar), motion, kMovingCar, shapes);
}

void addPedestrian(double x, double y, const Motion& motion, std::vector<Shape>& shapes) {
  addMoving(pillar(x, y, 0.28, 1.75, kPerson), motion, kMovingPerson, shapes);
}

/// A bicycle, alone or with its rider.
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

/// Houses, hedges and fences on one side of the street, `side` +1 or -1.
void addHouses(double length, double side, Dice& dice, std::vector<Shape>& shapes) {
  for (double x = kStart; x < kStart + length;) {
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

/// Cars at one side of the street, of which a fraction drives off.
void addParkedCars(double length, double side, double leaving, double duration, Dice& dice,
                   std::vector<Shape>& shapes) {
  for (double x = kStart + 2.0; x < kStart + length; x += dice.between(6.0, 14.0)) {
    Motion motion;
    if (leaving > 0.0 && dice.between(0.0, 1.0) < leaving) {
      motion = Motion::drivingOff(dice.between(0.1, 0.8) * duration, -4.0 * side, -1.0 * side);
    }
    addCar(x, side * 4.0, motion, shapes);
  }
}

void addFewPedestrians(double length, double side, Dice& dice, std::vector<Shape>& shapes) {
  for (double x = kStart; x < kStart + length; x += dice.between(12.0, 25.0)) {
    const double speed = dice.between(0.0, 1.0) < 0.3 ? 0.0 : side * dice.between(0.8, 1.6);
    addPedestrian(x, side * dice.between(6.6, 7.6), Motion::constant(speed), shapes);
  }
}

/// One car ahead in the sensor's lane (y = -1.5 m), others oncoming.
void addTraffic(double length, std::vector<Shape>& shapes, Dice& dice) {
  addCar(14.0, -1.5, Motion::constant(9.0), shapes);
  for (double x = 35.0; x < kStart + 2.5 * length; x += dice.between(30.0, 45.0))
    addCar(x, 1.5, Motion::constant(-9.0), shapes);
}

/// Queues that move and wait in turn: one ahead of the sensor, at a safe distance, and one oncoming.
void addQueues(double length, double duration, double speed, Dice& dice, std::vector<Shape>& shapes) {
  const double go = 3.0, stand = 4.0, own_speed = 1.1 * speed * (go + stand) / go;
  const double ahead = dice.between(-go, 0.0);
  for (double x = 10.0 + 4.0 * speed; x < kStart + length; x += dice.between(6.5, 9.0))
    addCar(x, -1.5, Motion::inTurns(own_speed, go, stand, ahead, duration), shapes);
  const double oncoming = dice.between(-go, 0.0), way = 3.0 * duration;
  for (double x = kStart; x < kStart + length + way; x += dice.between(6.5, 9.0))
    addCar(x, 1.5, Motion::inTurns(-5.0, go, stand, oncoming, duration), shapes);
}

/// Pedestrians and cyclists on the whole street, except where the sensor drives.
void addCrowd(double length, double duration, Dice& dice, std::vector<Shape>& shapes) {
  for (double x = kStart; x < kStart + length; x += dice.between(0.5, 1.5)) {
    const double y = dice.between(0.0, 1.0) < 0.3 ? dice.between(-8.0, -3.2) : dice.between(0.2, 8.0);
    const double speed = (dice.between(0.0, 1.0) < 0.5 ? -1.0 : 1.0) * dice.between(0.7, 1.6);
    const double go = dice.between(2.0, 8.0), stand = dice.between(1.0, 6.0), kind = dice.between(0.0, 1.0),
                 begin = dice.between(-go - stand, 0.0);
    if (kind < 0.1) {
      addPedestrian(x, y, Motion(), shapes);
    } else if (kind < 0.6) {
      addPedestrian(x, y, Motion::constant(speed), shapes);
    } else {
      addPedestrian(x, y, Motion::inTurns(speed, go, stand, begin, duration), shapes);
    }
  }
  for (double x = kStart; x < kStart + length + 4.0 * duration; x += dice.between(8.0, 20.0))
    addBicycle(x, dice.between(0.8, 2.5), Motion::constant(-dice.between(3.0, 5.0)), shapes);
  for (double x = kStart; x < kStart + length; x += dice.between(8.0, 20.0))
    addBicycle(x, 8.3, Motion(), shapes);
}

constexpr const char* kNames[] = {"street", "traffic", "crowd"};

}  // namespace

SceneKind sceneKindNamed(const std::string& name) {
  for (const SceneKind kind : {SceneKind::kStreet, SceneKind::kTraffic, SceneKind::kCrowd}) {
    if (nameOf(kind) == name) return kind;
  }
  throw std::invalid_argument("there is no scene " + name + "; known scenes: street, traffic, crowd");
}

std::string nameOf(SceneKind kind) {
  return kNames[static_cast<int>(kind)];
}

Scene makeScene(SceneKind kind, double length, double duration, double speed, std::uint64_t seed) {
  Scene scene;
  Dice dice(seed);
  std::vector<Shape>& shapes = scene.shapes;
  for (const double side : {-1.0, 1.0}) {
    addHouses(length, side, dice, shapes);
    for (double x = kStart + 4.0; x < kStart + length; x += dice.between(11.0, 17.0)) {
      addTree(x, side * 9.0, dice, shapes);
    }
    for (double x = kStart + 9.0; x < kStart + length; x += 25.0)
      shapes.push_back(pillar(x, side * 5.6, 0.1, 5.0, kPole));
    for (double x = kStart + 20.0; x < kStart + length; x += 40.0) {
      shapes.push_back(pillar(x, side * 5.9, 0.05, 2.2, kPole));
      shapes.push_back(box(x, side * 5.9, 2.5, 0.06, 0.7, 0.7, kSign));
    }
    if (kind == SceneKind::kCrowd) continue;
    addParkedCars(length, side, kind == SceneKind::kTraffic ? 0.25 : 0.0, duration, dice, shapes);
    addFewPedestrians(length, side, dice, shapes);
  }
  switch (kind) {
    case SceneKind::kStreet:
      addTraffic(length, shapes, dice);
      break;
    case SceneKind::kTraffic:
      addQueues(length, duration, speed, dice, shapes);
      break;
    case SceneKind::kCrowd:
      addCrowd(length, duration, dice, shapes);
      break;
  }
  return scene;
}

}  // namespace bki_mapping::simulation
