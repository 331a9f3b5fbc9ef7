#include <cmath>
#include <stdexcept>

#include "simulation/rooms.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

constexpr double kStart = -30.0;  ///< where the street begins [m]

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

/// Goes on and on, at a pace that changes every few seconds. @param slowest, fastest [m/s].
Motion creeping(double direction, double slowest, double fastest, double duration, Dice& dice) {
  Motion motion;
  for (double time = 0.0; time < duration;) {
    time += dice.between(2.0, 6.0);
    motion.legs.push_back({time, {direction * dice.between(slowest, fastest), 0.0, 0.0}});
  }
  return motion;
}

/// Queues that creep and never stand: one from close ahead of the sensor on, and one oncoming.
void addCreepingQueues(double length, double duration, double speed, Dice& dice, std::vector<Shape>& shapes) {
  constexpr double kFastest = 2.0, kSlowest = 0.5;  // [m/s]
  const Motion ahead = creeping(1.0, speed, speed + kFastest - kSlowest, duration, dice);
  for (double x = 7.0; x < kStart + length; x += dice.between(6.5, 9.0)) addCar(x, -1.5, ahead, shapes);
  const Motion oncoming = creeping(-1.0, kSlowest, kFastest, duration, dice);
  for (double x = kStart; x < kStart + length + kFastest * duration; x += dice.between(6.5, 9.0))
    addCar(x, 1.5, oncoming, shapes);
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

/// What comes, stands for a while, and goes or stays: cars beside the road, people and trolleys on the
/// pavement, people who sit down, and gates that open and close.
void addVisitors(double length, double duration, Dice& dice, std::vector<Shape>& shapes) {
  using Add = void (*)(double x, double y, const Motion& motion, std::vector<Shape>& shapes);
  const auto add = [&](Add visitor, double x, double y, double speed, double aside, double longest) {
    const double arrival = dice.between(0.1, 0.6) * duration, stand = dice.between(3.0, longest);
    const bool stays = dice.between(0.0, 1.0) < 0.4;
    const Motion motion = Motion::visiting(arrival, arrival + (stays ? 2.0 * duration : stand), speed, aside);
    const Eigen::Vector3d way = motion.wayUntil(arrival);
    visitor(x - way.x(), y - way.y(), motion, shapes);
  };
  for (double x = kStart; x < kStart + length; x += dice.between(7.0, 11.0))
    add(addCar, x, 4.0, 6.0, 2.5, 0.5 * duration);
  for (double x = kStart; x < kStart + length; x += dice.between(4.0, 8.0)) {
    const double side = dice.between(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
    add(addPedestrian, x, side * dice.between(6.0, 7.8), side * dice.between(0.8, 1.6), 0.0, 10.0);
  }
  for (double x = kStart + 3.0; x < kStart + length; x += dice.between(10.0, 16.0))
    add(addTrolley, x, -dice.between(5.7, 7.0), 1.0, 0.0, 0.5 * duration);
  for (double x = kStart + 2.0; x < kStart + length; x += dice.between(9.0, 15.0)) {
    const double arrival = dice.between(0.05, 0.4) * duration;
    const Motion motion = Motion::sitting(arrival, arrival + dice.between(4.0, 9.0), 1.2, 0.6);
    addPedestrian(x - motion.wayUntil(arrival).x(), dice.between(6.0, 7.8), motion, shapes);
  }
  for (double x = kStart + 6.0; x < kStart + length; x += dice.between(12.0, 20.0))
    addGate(x, 8.5, Motion::sliding(2.3, dice.between(2.0, 6.0), dice.between(2.0, 6.0), duration), shapes);
}

constexpr const char* kNames[] = {"street", "traffic", "crowd", "arrivals", "queue", "rooms", "trajectory"};

}  // namespace

SceneKind sceneKindNamed(const std::string& name) {
  for (const SceneKind kind :
       {SceneKind::kStreet, SceneKind::kTraffic, SceneKind::kCrowd, SceneKind::kArrivals, SceneKind::kQueue,
        SceneKind::kRooms, SceneKind::kTrajectory}) {
    if (nameOf(kind) == name) return kind;
  }
  throw std::invalid_argument("there is no scene " + name +
                              "; known scenes: street, traffic, crowd, arrivals, queue, rooms");
}

std::string nameOf(SceneKind kind) {
  return kNames[static_cast<int>(kind)];
}

Scene makeScene(SceneKind kind, double length, double duration, double speed, std::uint64_t seed) {
  if (kind == SceneKind::kRooms) return makeRooms(seed);
  Scene scene;
  Dice dice(seed);
  std::vector<Shape>& shapes = scene.shapes;
  for (const double side : {-1.0, 1.0}) {
    addHouses(kStart, kStart + length, side, dice, shapes);
    for (double x = kStart + 4.0; x < kStart + length; x += dice.between(11.0, 17.0)) {
      addTree(x, side * 9.0, dice, shapes);
    }
    for (double x = kStart + 9.0; x < kStart + length; x += 25.0) addLampPost(x, side, shapes);
    for (double x = kStart + 20.0; x < kStart + length; x += 40.0) addSign(x, side, shapes);
    if (kind == SceneKind::kCrowd) continue;
    if (kind == SceneKind::kArrivals) {
      if (side < 0.0) addParkedCars(length, side, 0.0, duration, dice, shapes);
      continue;
    }
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
    case SceneKind::kArrivals:
      addVisitors(length, duration, dice, shapes);
      break;
    case SceneKind::kQueue:
      addCreepingQueues(length, duration, speed, dice, shapes);
      break;
    case SceneKind::kRooms:
    case SceneKind::kTrajectory:
      break;
  }
  return scene;
}

}  // namespace bki_mapping::simulation
