#include "simulation/oncoming.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/pi.h"
#include "simulation/street_along.h"

namespace bki_mapping::simulation {
namespace {

constexpr double kOncomingSpeed = 8.0;  ///< [m/s]
constexpr double kLeft = 3.0;           ///< from the way of the sensor to the lane of the cars [m]
constexpr double kLongest = 40.0;       ///< from when a car appears to when it meets the sensor [s]
constexpr double kLeg = 0.25;           ///< duration of a leg [s]
constexpr double kCarLength = 4.3, kCarWidth = 1.8;  ///< as addCar makes them [m]

/// The sensor's place at any time; before its first scan and after its last one it rests.
class Sensor {
 public:
  Sensor(const std::vector<Eigen::Vector3d>& positions, const Way& way, double rate)
      : positions_(positions), way_(way), rate_(rate) {}
  double end() const { return static_cast<double>(positions_.size() - 1) / rate_; }
  Eigen::Vector2d at(double time) const {
    return mixed(time, [this](std::size_t i) -> Eigen::Vector2d { return positions_[i].head<2>(); });
  }
  /// Length of the way that it has driven.
  double drivenAt(double time) const {
    return mixed(time, [this](std::size_t i) { return way_.lengthAt(i); });
  }

 private:
  template <typename Value>
  auto mixed(double time, Value&& value) const -> decltype(value(0)) {
    const double scan = std::clamp(time * rate_, 0.0, static_cast<double>(positions_.size() - 1));
    const auto i = static_cast<std::size_t>(scan);
    if (i + 1 == positions_.size()) return value(i);
    const double part = scan - static_cast<double>(i);
    return (1.0 - part) * value(i) + part * value(i + 1);
  }

  const std::vector<Eigen::Vector3d>& positions_;
  const Way& way_;
  double rate_;
};

/// A car that drives against the way.
struct OncomingCar {
  double meets;                          ///< when it is beside the sensor [s]
  double length;                         ///< of the way there [m]
  double appears = 0.0, vanishes = 0.0;  ///< [s]

  double lengthAt(double time) const { return length - kOncomingSpeed * (time - meets); }
  Footprint placeAt(double time, const Way& way) const {
    const WayPoint there = way.at(lengthAt(time));
    return {there.beside(kLeft), {0.5 * kCarLength, 0.5 * kCarWidth}, there.heading + kPi};
  }
};

/// The moment from which on, going away from the meeting in steps, a car is out of the sensor's range.
/// @param step < 0: into the past [s]. @return nullopt if the street ends before.
std::optional<double> outOfRange(const OncomingCar& car, const Sensor& sensor, const Way& way, double range,
                                 double step) {
  for (double ago = 0.0; std::abs(ago) < kLongest; ago += step) {
    const double time = car.meets + ago, s = car.lengthAt(time);
    if (s < way.begin() || s > way.end()) return std::nullopt;
    if (car.placeAt(time, way).distanceTo(sensor.at(time)) > range) return time;
  }
  return std::nullopt;
}

/// Whether a car keeps clear of the sensor, of what stands, and of other cars.
/// @param others may be on the road at the same time.
bool isClear(const OncomingCar& car, const std::vector<OncomingCar>& others, const Sensor& sensor,
             const Way& way, const Plots& plots) {
  constexpr double kStep = 0.02;  // [s]
  for (double time = car.appears; time <= car.vanishes; time += kStep) {
    const Footprint place = car.placeAt(time, way);
    if (place.distanceTo(sensor.at(time)) < kClearance + 0.2 || !plots.isFree(place, 0.0, 0.2)) return false;
    for (const OncomingCar& other : others) {
      if (other.appears <= time && time <= other.vanishes && place.meets(other.placeAt(time, way), 1.0))
        return false;
    }
  }
  return true;
}

/// The shapes of a car, with a leg for each quarter of a second.
void addShapes(const OncomingCar& car, const Way& way, const Ground& ground, std::vector<Shape>& shapes) {
  const auto poseAt = [&](double time) {
    const Footprint place = car.placeAt(time, way);
    return std::make_pair(Eigen::Vector3d(place.centre.x(), place.centre.y(),
                                          ground.heightAt(place.centre.x(), place.centre.y())),
                          place.yaw);
  };
  const double begin = std::max(0.0, car.appears);
  auto [at, yaw] = poseAt(begin);
  Motion motion;
  if (begin > 0.0) motion.legs.push_back({begin, Eigen::Vector3d::Zero()});
  for (double time = begin; time < car.vanishes;) {
    const double next = std::min(time + kLeg, car.vanishes);
    const auto [there, heading] = poseAt(next);
    motion.legs.push_back(
        {next, (there - at) / (next - time), std::remainder(heading - yaw, 2.0 * kPi) / (next - time)});
    time = next;
    at = there;
    yaw = heading;
  }
  std::vector<Shape> parts;
  addCar(0.0, 0.0, motion, parts);
  const auto [start, heading] = poseAt(begin);
  for (Shape& part : parts) {
    // All parts turn about the middle of the body.
    const Eigen::Vector2d offset = Eigen::Rotation2Dd(heading) * part.centre.head<2>();
    part.hinge = -offset;
    part.centre = start + Eigen::Vector3d(offset.x(), offset.y(), part.centre.z());
    part.yaw = heading;
    part.appears = car.appears;
    part.vanishes = car.vanishes;
    shapes.push_back(std::move(part));
  }
}

}  // namespace

void addOncomingCars(const std::vector<Eigen::Vector3d>& positions, const Way& way, const Plots& plots,
                     const DriveConfig& config, Dice& dice, Scene& scene) {
  const Sensor sensor(positions, way, config.lidar.rate);
  std::vector<OncomingCar> recent;
  for (double time = dice.between(1.0, 4.0); time < sensor.end(); time += dice.between(4.0, 9.0)) {
    OncomingCar car{time, sensor.drivenAt(time)};
    const auto appears = outOfRange(car, sensor, way, config.lidar.max_range, -kLeg);
    const auto vanishes = outOfRange(car, sensor, way, config.lidar.max_range, kLeg);
    if (!appears || !vanishes) continue;
    car.appears = *appears;
    car.vanishes = *vanishes;
    recent.erase(std::remove_if(recent.begin(), recent.end(),
                                [&](const OncomingCar& other) { return other.vanishes < time - kLongest; }),
                 recent.end());
    if (!isClear(car, recent, sensor, way, plots)) continue;
    recent.push_back(car);
    addShapes(car, way, scene.ground, scene.shapes);
  }
}

}  // namespace bki_mapping::simulation
