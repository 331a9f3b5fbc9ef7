#include "simulation/city.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "bki_mapping/core/named_parameter.h"
#include "core/pi.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

constexpr double kLane = 1.5;     ///< distance of a lane from the axis of its street [m]
constexpr double kTurn = 6.0;     ///< radius of turns [m]
constexpr double kSpeed = 9.0;    ///< of traffic [m/s]
constexpr double kHeight = 1.73;  ///< of the sensor above the ground, as in KITTI [m]

/// A direction along the grid: 0 to 3 for +x, +y, -x, -y.
Eigen::Vector2d alongOf(int direction) {
  constexpr std::array<std::array<double, 2>, 4> kDirections{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
  const auto& d = kDirections[static_cast<std::size_t>(direction)];
  return {d[0], d[1]};
}

Eigen::Vector2d rightOf(const Eigen::Vector2d& along) {
  return {along.y(), -along.x()};
}

/// Moves what was placed along x from (0, 0) on into a street from `start` on, along x or y.
void place(const std::vector<Shape>& shapes, const Eigen::Vector2d& start, bool along_y,
           std::vector<Shape>& into) {
  const auto turned = [&](const Eigen::Vector3d& v) {
    return along_y ? Eigen::Vector3d(-v.y(), v.x(), v.z()) : v;
  };
  for (Shape shape : shapes) {
    shape.centre = turned(shape.centre) + Eigen::Vector3d(start.x(), start.y(), 0.0);
    shape.velocity = turned(shape.velocity);
    if (along_y) std::swap(shape.half.x(), shape.half.y());
    into.push_back(std::move(shape));
  }
}

/// Calls visit(start, along_y) for each street between two neighbouring crossings.
template <typename Visit>
void forEachStreet(const CityConfig& config, Visit&& visit) {
  for (int street = 0; street <= config.blocks; ++street) {
    for (int block = 0; block < config.blocks; ++block) {
      const double axis = street * config.block_edge, from = block * config.block_edge;
      visit(Eigen::Vector2d(from, axis), false);
      visit(Eigen::Vector2d(axis, from), true);
    }
  }
}

/// The parking spaces of a street along x, from crossing to crossing.
template <typename Visit>
void forEachParkingSpace(double edge, Dice& dice, Visit&& visit) {
  for (const double side : {-1.0, 1.0}) {
    for (double x = 14.0; x < edge - 14.0; x += dice.between(6.0, 14.0)) visit(x, side * 4.0);
  }
}

/// What stands in a street along x, from crossing to crossing.
std::vector<Shape> standingIn(double edge, bool along_y, Dice& dice) {
  std::vector<Shape> shapes;
  const double corner = along_y ? 26.0 : 12.0;  // the houses at a corner belong to the street along x
  for (const double side : {-1.0, 1.0}) {
    addHouses(corner, edge - corner - 15.0, side, dice, shapes);
    for (double x = 12.0; x < edge - 12.0; x += dice.between(11.0, 17.0))
      addTree(x, side * 9.0, dice, shapes);
    for (double x = 10.0; x < edge - 8.0; x += 25.0) addLampPost(x, side, shapes);
    addSign(8.0, side, shapes);
  }
  return shapes;
}

/// Cars along the whole of each street, in both lanes, before, during and after the drive.
void addTraffic(const CityConfig& config, Dice& dice, std::vector<Shape>& shapes) {
  const double length = config.blocks * config.block_edge, way = kSpeed * config.drive.duration();
  for (int street = 0; street <= config.blocks; ++street) {
    for (const bool along_y : {false, true}) {
      std::vector<Shape> cars;
      for (double x = -way - 50.0; x < length + 50.0; x += dice.between(40.0, 80.0))
        addCar(x, -kLane, Motion::constant(kSpeed), cars);
      for (double x = -50.0; x < length + way + 50.0; x += dice.between(40.0, 80.0))
        addCar(x, kLane, Motion::constant(-kSpeed), cars);
      const double axis = street * config.block_edge;
      place(cars, along_y ? Eigen::Vector2d(axis, 0.0) : Eigen::Vector2d(0.0, axis), along_y, shapes);
    }
  }
}

void addPedestrians(double edge, Dice& dice, std::vector<Shape>& shapes) {
  for (const double side : {-1.0, 1.0}) {
    for (double x = dice.between(0.0, 12.0); x < edge; x += dice.between(12.0, 25.0)) {
      const double speed = dice.between(0.0, 1.0) < 0.3 ? 0.0 : side * dice.between(0.8, 1.6);
      addPedestrian(x, side * dice.between(6.6, 7.6), Motion::constant(speed), shapes);
    }
  }
}

/// Whether something moving comes so near to the sensor that the two would touch.
bool meetsSensor(const Shape& shape, const CityRoute& route, const DriveConfig& config) {
  if (shape.velocity.isZero()) return false;
  // Fewer than 2 m lie between the checked times, even if the two approach each other.
  const double step = 1.5 / (kSpeed + config.speed), end = config.duration();
  for (double time = 0.0; time < end + step; time += step) {
    const Eigen::Vector3d to =
        route.at(config.speed * std::min(time, end)).translation() - shape.centreAt(time);
    if (std::abs(to.x()) < shape.half.x() + 2.5 && std::abs(to.y()) < shape.half.y() + 1.0) return true;
  }
  return false;
}

const CityConfig& checked(const CityConfig& config) {
  checkDrive(config.drive);
  const auto limit = [](const char* name, double value, double least, double most) {
    if (value >= least && value <= most) return;
    throw std::invalid_argument(std::string(name) + " is " + numberText(value) + ", but must be from " +
                                numberText(least) + " to " + numberText(most));
  };
  limit("drives", config.drives, 1, 10000);
  limit("blocks", config.blocks, 1, 100);
  limit("block-edge", config.block_edge, 60, 1000);
  if (!(config.drive.duration() <= 1e4))  // before the cars that pass in this time take memory
    throw std::invalid_argument("a drive must not last longer than 10000 s; lower scans, or raise rate");
  if (2.0 * config.blocks * (config.blocks + 1) * config.block_edge > 500e3)
    throw std::invalid_argument(
        "the streets must not be longer than 500 km in all; lower blocks or block-edge");
  return config;
}

}  // namespace

CityRoute::CityRoute(int blocks, double block_edge, double length, std::uint64_t seed, std::uint64_t drive) {
  Dice dice(seed, 2 * drive + 2);
  const auto inside = [&](const Eigen::Vector2i& crossing) {
    return crossing.minCoeff() >= 0 && crossing.maxCoeff() <= blocks;
  };
  const auto next = [](const Eigen::Vector2i& crossing, int direction) {
    return Eigen::Vector2i(crossing + alongOf(direction).cast<int>());
  };
  // It starts beside a block, which is on its left (turn = 1) or on its right (turn = 3).
  Eigen::Vector2i crossing;
  int direction = 0, turn = 0;
  do {
    crossing = {dice.below(blocks + 1), dice.below(blocks + 1)};
    direction = dice.below(4);
    turn = dice.below(2) == 0 ? 1 : 3;
  } while (!inside(next(crossing, direction)) || !inside(next(crossing, (direction + turn) % 4)));
  const auto laneAt = [&](const Eigen::Vector2i& at, int a, int b) -> Eigen::Vector2d {
    return at.cast<double>() * block_edge +
           kLane * (rightOf(alongOf(a)) + (a == b ? Eigen::Vector2d(0, 0) : rightOf(alongOf(b))));
  };
  double way = 0.0;
  Eigen::Vector2d at =
      laneAt(crossing, direction, direction) + alongOf(direction) * block_edge * dice.between(0.2, 0.5);
  for (int turns = 0; way <= length;) {
    const Eigen::Vector2i there = next(crossing, direction);
    int change = turn;
    if (turns >= 4) {
      do {
        change = std::array<int, 3>{0, 1, 3}[static_cast<std::size_t>(dice.below(3))];
      } while (!inside(next(there, (direction + change) % 4)));
    }
    crossing = there;
    const Eigen::Vector2d along = alongOf(direction);
    const double heading = direction * kPi / 2.0;
    const int after = (direction + change) % 4;
    const Eigen::Vector2d corner = laneAt(there, direction, after);
    const Eigen::Vector2d end = change == 0 ? corner : Eigen::Vector2d(corner - kTurn * along);
    parts_.push_back({way, at, heading, 0.0});
    way += (end - at).dot(along);
    at = end;
    if (change != 0) {
      parts_.push_back({way, at, heading, (change == 1 ? 1.0 : -1.0) / kTurn});
      way += kTurn * kPi / 2.0;
      at = corner + kTurn * alongOf(after);
      ++turns;
    }
    direction = after;
  }
}

Eigen::Isometry3d CityRoute::at(double way) const {
  const auto after = std::upper_bound(parts_.begin() + 1, parts_.end(), way,
                                      [](double w, const Part& part) { return w < part.begin; });
  const Part& part = *std::prev(after);
  const double s = way - part.begin, c = part.curvature, a = part.heading, b = a + c * s;
  Eigen::Vector2d position = part.start;
  if (c == 0.0) {
    position += s * Eigen::Vector2d(std::cos(a), std::sin(a));
  } else {
    position += Eigen::Vector2d(std::sin(b) - std::sin(a), std::cos(a) - std::cos(b)) / c;
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << position, kHeight;
  T.linear() = Eigen::AngleAxisd(b, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

CityDrive::CityDrive(const CityConfig& config, const Scene& city, std::uint64_t drive)
    : config_(config.drive),
      route_(config.blocks, config.block_edge, config_.speed * config_.duration(), config_.seed, drive),
      scene_(city) {
  // Streams 0 and 1 are the city's; each drive has a stream for its route and one for what it sees.
  Dice dice(config_.seed, 2 * drive + 3), spaces(config_.seed, 1);
  std::vector<Shape> moving;
  forEachStreet(config, [&](const Eigen::Vector2d& start, bool along_y) {
    std::vector<Shape> here;
    forEachParkingSpace(config.block_edge, spaces, [&](double x, double y) {
      if (spaces.between(0.0, 1.0) >= 0.7 && dice.between(0.0, 1.0) < 0.5) addCar(x, y, Motion(), here);
    });
    addPedestrians(config.block_edge, dice, here);
    place(here, start, along_y, moving);
  });
  addTraffic(config, dice, moving);
  for (std::size_t s = 0; s < moving.size(); ++s) {
    // A car is two shapes, body and cabin, of which the body is the longer one.
    const bool is_car = moving[s].label == kMovingCar;
    if (!meetsSensor(moving[s], route_, config_)) {
      scene_.shapes.push_back(moving[s]);
      if (is_car) scene_.shapes.push_back(moving[s + 1]);
    }
    s += is_car;
  }
  config_.lidar.seed = mixBits(config_.seed) ^ drive;
}

SequenceFrame CityDrive::frame(std::size_t i) const {
  const Eigen::Isometry3d T = T_city_sensor(i);
  const double time = timeOf(i);
  Scene near{scene_.ground, {}};
  for (const Shape& shape : scene_.shapes) {
    const double reach = config_.lidar.max_range + shape.half.head<2>().norm();
    if ((shape.centreAt(time) - T.translation()).head<2>().squaredNorm() < reach * reach)
      near.shapes.push_back(shape);
  }
  SequenceFrame frame = scan(near, config_.lidar, T, time, i);
  frame.T_map_sensor = T;
  frame.stamp = Sequence::kFirstStamp + static_cast<std::uint64_t>(std::llround(time * 1e9));
  return frame;
}

City::City(const CityConfig& config) : config_(checked(config)) {
  scene_.ground.street_distance = config_.block_edge;
  scene_.ground.streets = config_.blocks + 1;
  Dice dice(config_.drive.seed), spaces(config_.drive.seed, 1);
  forEachStreet(config_, [&](const Eigen::Vector2d& start, bool along_y) {
    std::vector<Shape> here = standingIn(config_.block_edge, along_y, dice);
    forEachParkingSpace(config_.block_edge, spaces, [&](double x, double y) {
      if (spaces.between(0.0, 1.0) < 0.7) addCar(x, y, Motion(), here);
    });
    place(here, start, along_y, scene_.shapes);
  });
}

}  // namespace bki_mapping::simulation
