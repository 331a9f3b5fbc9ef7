#include <cmath>

#include "parallel/counter_random.h"
#include "simulation/scene.h"

namespace bki_mapping::simulation {
namespace {

// Raw SemanticKITTI labels.
constexpr std::uint32_t kCar = 10, kPerson = 30, kBuilding = 50, kFence = 51, kVegetation = 70, kTrunk = 71,
                        kPole = 80, kSign = 81, kMovingCar = 252, kMovingPerson = 254;
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
  return {ShapeType::kBox,         {x, y, z}, {length / 2, width / 2, height / 2}, 0.0,
          Eigen::Vector3d::Zero(), label};
}

Shape pillar(double x, double y, double radius, double height, std::uint32_t label) {
  return {ShapeType::kCylinder,         {x, y, height / 2},
          {radius, radius, height / 2}, 0.0,
          Eigen::Vector3d::Zero(),      label};
}

/// Body and cabin of a car; speed along x [m/s].
void addCar(double x, double y, double speed, std::vector<Shape>& shapes) {
  Shape body = box(x, y, 0.65, 4.3, 1.8, 0.8, kCar), cabin = box(x - 0.2, y, 1.25, 2.2, 1.6, 0.5, kCar);
  for (Shape* part : {&body, &cabin}) {
    part->velocity.x() = speed;
    if (speed != 0.0) part->label = kMovingCar;
    shapes.push_back(*part);
  }
}

void addPedestrian(double x, double y, double speed, std::vector<Shape>& shapes) {
  Shape person = pillar(x, y, 0.28, 1.75, speed != 0.0 ? kMovingPerson : kPerson);
  person.velocity.x() = speed;
  shapes.push_back(person);
}

void addTree(double x, double y, Dice& dice, std::vector<Shape>& shapes) {
  const double height = dice.between(2.0, 3.0), crown = dice.between(1.2, 2.0);
  shapes.push_back(pillar(x, y, 0.2, height, kTrunk));
  shapes.push_back({ShapeType::kEllipsoid,
                    {x, y, height + 0.8 * crown},
                    {crown, crown, 1.2 * crown},
                    0.0,
                    Eigen::Vector3d::Zero(),
                    kVegetation});
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

}  // namespace

Scene makeStreet(double length, std::uint64_t seed) {
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
    for (double x = kStart + 2.0; x < kStart + length; x += dice.between(6.0, 14.0))
      addCar(x, side * 4.0, 0.0, shapes);
    for (double x = kStart; x < kStart + length; x += dice.between(12.0, 25.0)) {
      const double speed = dice.between(0.0, 1.0) < 0.3 ? 0.0 : side * dice.between(0.8, 1.6);
      addPedestrian(x, side * dice.between(6.6, 7.6), speed, shapes);
    }
  }
  // Traffic: one car ahead in the sensor's lane (y = -1.5), others oncoming.
  addCar(14.0, -1.5, 9.0, shapes);
  for (double x = 35.0; x < kStart + 2.5 * length; x += dice.between(30.0, 45.0))
    addCar(x, 1.5, -9.0, shapes);
  return scene;
}

}  // namespace bki_mapping::simulation
