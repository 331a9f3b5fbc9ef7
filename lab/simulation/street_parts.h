/// @file What stands and moves in simulated streets.
#pragma once

#include <cstdint>
#include <vector>

#include "parallel/counter_random.h"
#include "simulation/scene.h"

namespace bki_mapping::simulation {

// Raw SemanticKITTI labels.
constexpr std::uint32_t kCar = 10, kBicycle = 11, kPerson = 30, kBuilding = 50, kFence = 51, kVegetation = 70,
                        kTrunk = 71, kPole = 80, kSign = 81, kMovingCar = 252, kMovingBicyclist = 253,
                        kMovingPerson = 254, kMovingVehicle = 259;

/// A sequence of random numbers. Different streams of a seed are independent.
class Dice {
 public:
  explicit Dice(std::uint64_t seed, std::uint64_t stream = 0) : seed_(seed), stream_(stream) {}
  double between(double low, double high) {
    return low + (high - low) * counterRandom(seed_, stream_, 0, count_++);
  }
  /// @return an integer from 0 to count - 1. @param count > 0.
  int below(int count) { return static_cast<int>(between(0.0, count)); }

 private:
  std::uint64_t seed_, stream_, count_ = 0;
};

/// How something moves: over legs, and then on with a last velocity.
struct Motion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  std::vector<Leg> legs;

  static Motion constant(double speed) { return {{speed, 0.0, 0.0}, {}}; }
  /// Goes and stands in turn until the end.
  /// @param speed while it goes [m/s]. @param go, stand duration of each [s]. @param begin of the first
  /// cycle, which may lie before time 0 [s].
  static Motion inTurns(double speed, double go, double stand, double begin, double end);
  /// Stands, pulls out towards the middle of the street, and drives away along it.
  /// @param to lateral distance of the lane [m].
  static Motion drivingOff(double start, double speed, double to);
  /// Comes along x, moves aside to its place, stands there, and goes as it came. Where it is at time 0
  /// follows.
  /// @param arrival, departure when it comes to a stand, and when it moves again [s]. @param aside from its
  /// way to its place [m].
  static Motion visiting(double arrival, double departure, double speed, double aside);
  /// The same, but sits down after a second, and gets up before it goes.
  /// @param down by how much its head sinks [m]. @param departure at least 3 s after the arrival [s].
  static Motion sitting(double arrival, double departure, double speed, double down);
  /// Slides along x and back in turn until the end. @param way [m], which takes a second.
  /// @param closed, open how long it stands at either end [s].
  static Motion sliding(double way, double closed, double open, double end);
  /// How far it goes in the legs that end by a time.
  Eigen::Vector3d wayUntil(double time) const;
  bool moves() const { return !velocity.isZero() || !legs.empty(); }
};

Shape box(double x, double y, double z, double length, double width, double height, std::uint32_t label);
Shape pillar(double x, double y, double radius, double height, std::uint32_t label);

/// Body and cabin of a car along x.
void addCar(double x, double y, const Motion& motion, std::vector<Shape>& shapes);
void addPedestrian(double x, double y, const Motion& motion, std::vector<Shape>& shapes);
/// A gate between two posts, along x, whose wing slides.
void addGate(double x, double y, const Motion& motion, std::vector<Shape>& shapes);
/// A trolley, as large as a cupboard.
void addTrolley(double x, double y, const Motion& motion, std::vector<Shape>& shapes);
/// A bicycle, alone or with its rider.
void addBicycle(double x, double y, const Motion& motion, std::vector<Shape>& shapes);
void addTree(double x, double y, Dice& dice, std::vector<Shape>& shapes);
/// A lamp post beside the road of a street along x. @param side +1 or -1.
void addLampPost(double x, double side, std::vector<Shape>& shapes);
/// A sign on a post, likewise.
void addSign(double x, double side, std::vector<Shape>& shapes);

/// Houses, hedges and fences on one side of a street along x from `begin` to `end` [m]. The last house may
/// extend beyond the end.
void addHouses(double begin, double end, double side, Dice& dice, std::vector<Shape>& shapes);

}  // namespace bki_mapping::simulation
