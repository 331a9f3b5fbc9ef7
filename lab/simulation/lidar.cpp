#include "simulation/lidar.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "bki_mapping/core/named_parameter.h"
#include "core/pi.h"
#include "parallel/counter_random.h"
#include "parallel/thread_pool.h"
#include "simulation/rooms.h"
#include "simulation/street_along.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

Return cast(const Scene& scene, const std::vector<const Shape*>& shapes, const Eigen::Vector3d& origin,
            const Eigen::Vector3d& direction, double time, double max_range) {
  Return nearest{max_range, 0, nullptr};
  if (const auto ground = scene.ground.hit(origin, direction, max_range)) {
    nearest.range = *ground;
    nearest.label = scene.ground.labelAt(origin.x() + nearest.range * direction.x(),
                                         origin.y() + nearest.range * direction.y());
  }
  for (const Shape* shape : shapes) {
    const auto range = shape->hit(origin, direction, time);
    if (range && *range < nearest.range) nearest = {*range, shape->label, shape};
  }
  return nearest.range < max_range ? nearest : Return{};
}

/// Tangent of the angle between two directions, seen from above; infinity from a right angle on.
double spreadOf(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double along = a.head<2>().dot(b.head<2>());
  if (!(along > 0.0)) return std::numeric_limits<double>::infinity();
  return std::abs(a.x() * b.y() - a.y() * b.x()) / along;
}

/// The shapes that a fan of beams may hit, which is vertical if the sensor is upright.
/// @param direction of the middle beam. @param spread tangent of the angle between it and the farthest beam,
/// seen from above.
std::vector<const Shape*> shapesInFan(const Scene& scene, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double time, double max_range,
                                      double spread = 0.0) {
  std::vector<const Shape*> shapes;
  const Eigen::Vector2d forward = direction.head<2>().normalized();
  for (const Shape& shape : scene.shapes) {
    const Eigen::Vector2d to = (shape.centreAt(time) - origin).head<2>();
    const double radius = shape.half.head<2>().norm();
    const double along = to.dot(forward), aside = to.x() * forward.y() - to.y() * forward.x();
    const bool within =
        along > -radius && along < max_range + radius && std::abs(aside) < radius + spread * (along + radius);
    if (within || std::isinf(spread)) shapes.push_back(&shape);
  }
  return shapes;
}

/// The normal of the wall that a point is on, if there is a pane of glass; 0 if there is none. Panes are 1.4
/// m wide and high, and 3 m apart.
Eigen::Vector3d paneNormal(const Shape& house, const Eigen::Vector3d& point, double time) {
  const Eigen::Vector3d from_centre = point - house.centreAt(time);
  const Eigen::Array3d faces = from_centre.array().abs() / house.half.array();
  const int axis = faces.x() > faces.y() ? 0 : 1;
  const auto isInPane = [](double at) {
    const double within = at - 3.0 * std::floor(at / 3.0);
    return within > 0.8 && within < 2.2;
  };
  if (faces.z() > faces[axis] || !isInPane(point.z()) || !isInPane(point[1 - axis])) return {0.0, 0.0, 0.0};
  return std::copysign(1.0, from_centre[axis]) * Eigen::Vector3d::Unit(axis);
}

/// What a beam that meets a pane sees: the pane, nothing in the dark room behind it, or what the pane
/// mirrors. That appears in the direction of the beam, beyond the wall.
Return seenInPane(const Scene& scene, const Return& wall, const Eigen::Vector3d& origin,
                  const Eigen::Vector3d& direction, double time, double max_range, BeamDice& dice) {
  const Eigen::Vector3d at = origin + wall.range * direction, normal = paneNormal(*wall.shape, at, time);
  if (normal.isZero()) return wall;
  const double kind = dice.next();
  if (kind < 0.3) return wall;
  if (kind < 0.7) return {};
  const Eigen::Vector3d away = direction - 2.0 * normal.dot(direction) * normal;
  const double left = max_range - wall.range;
  const Return image = cast(scene, shapesInFan(scene, at, away, time, left), at, away, time, left);
  if (image.range == 0.0) return {};
  return {wall.range + image.range, kImage | image.label, image.shape};
}

/// The label of a shape chosen at random. @param pick uniform on [0, 1).
std::uint32_t randomLabel(const Scene& scene, double pick) {
  return scene.shapes[static_cast<std::size_t>(pick * static_cast<double>(scene.shapes.size()))].label;
}

/// Whether there are poses for each scan, of a trajectory along which a street can be laid out.
void checkTrajectory(const DriveConfig& config) {
  const std::size_t poses = config.trajectory.size();
  if (config.scene != SceneKind::kTrajectory) {
    if (poses > 0) throw std::invalid_argument("the scene " + nameOf(config.scene) + " takes no trajectory");
    return;
  }
  if (poses == 0) throw std::invalid_argument("the scene trajectory needs poses; give --trajectory FILE");
  if (static_cast<std::size_t>(config.scans) > poses) {
    throw std::invalid_argument("scans is " + std::to_string(config.scans) +
                                ", but the trajectory has only " + std::to_string(poses) + " poses");
  }
  double length = 0.0;
  for (std::size_t i = 1; i < poses; ++i)
    length += (config.trajectory[i].translation() - config.trajectory[i - 1].translation()).norm();
  if (!(length <= 1e5))
    throw std::invalid_argument("a trajectory must not be longer than 100 km; give a part of it");
}

const DriveConfig& checked(const DriveConfig& config) {
  checkDrive(config);
  return config;
}

}  // namespace

void checkDrive(const DriveConfig& config) {
  const LidarConfig& lidar = config.lidar;
  const bool rooms = config.scene == SceneKind::kRooms;
  struct Limit {
    const char* name;
    double value, least, most;
  };
  for (const Limit& l : {Limit{"scans", static_cast<double>(config.scans), 1, 1e6},
                         {"speed", config.speed, 0, 100},
                         {"height", config.height, 0.1, rooms ? kDoorHeight - 0.1 : 100.0},
                         {"beams", static_cast<double>(lidar.beams), 1, 1024},
                         {"columns", static_cast<double>(lidar.columns), 1, 100000},
                         {"lowest", lidar.lowest, -kPi / 2, kPi / 2},
                         {"highest", lidar.highest, -kPi / 2, kPi / 2},
                         {"rate", lidar.rate, 1e-3, 1e6},
                         {"max-range", lidar.max_range, 0.01, 1e4},
                         {"range-noise", lidar.range_noise, 0, 100},
                         {"label-noise", lidar.label_noise, 0, 1}}) {
    if (l.value >= l.least && l.value <= l.most) continue;
    throw std::invalid_argument(std::string(l.name) + " is " + numberText(l.value) + ", but must be from " +
                                numberText(l.least) + " to " + numberText(l.most));
  }
  checkTrajectory(config);
  if (!(config.speed * config.duration() <= 1e6)) {  // before makeScene allocates a street of this length
    throw std::invalid_argument(
        "a drive must not be longer than 1000 km; lower scans or speed, or raise rate");
  }
}

DriveConfig usualDrive(SceneKind scene) {
  DriveConfig drive;
  drive.scene = scene;
  switch (scene) {
    case SceneKind::kStreet:
    case SceneKind::kTrajectory:
      break;
    case SceneKind::kTraffic:
      drive.speed = 3.0;
      break;
    case SceneKind::kCrowd:
      drive.speed = 2.0;
      break;
    case SceneKind::kArrivals:
      drive.speed = 1.0;
      break;
    case SceneKind::kQueue:
      drive.speed = 0.5;
      break;
    case SceneKind::kRooms:
      drive.speed = 0.5;
      drive.height = 0.35;
      drive.lidar = lidarNamed("vlp16");
      break;
  }
  return drive;
}

LidarConfig lidarNamed(const std::string& name) {
  LidarConfig lidar;
  const auto rows = [&](int beams, double lowest, double highest) {
    lidar.beams = beams;
    lidar.lowest = lowest * kPi / 180.0;
    lidar.highest = highest * kPi / 180.0;
  };
  if (name == "hdl32") {
    rows(32, -30.67, 10.67);
  } else if (name == "vlp16") {
    rows(16, -15.0, 15.0);
  } else if (name != "hdl64") {
    throw std::invalid_argument("there is no lidar " + name + "; known lidars: hdl64, hdl32, vlp16");
  }
  return lidar;
}

SequenceFrame scan(const Scene& scene, const LidarConfig& lidar, const Eigen::Isometry3d& T_world_sensor,
                   double time, std::uint64_t scan, const WeatherConfig& conditions) {
  const Weather weather(conditions, lidar.max_range);
  const Eigen::Vector3d origin = T_world_sensor.translation();
  const auto beams = static_cast<std::size_t>(lidar.beams), columns = static_cast<std::size_t>(lidar.columns);
  const double step = lidar.beams > 1 ? (lidar.highest - lidar.lowest) / (lidar.beams - 1) : 0.0;
  std::vector<Return> returns(beams * columns);
  const auto directionOf = [&](std::size_t column, std::size_t beam) {
    const double azimuth = 2.0 * kPi * static_cast<double>(column) / static_cast<double>(columns);
    const double elevation = lidar.lowest + step * static_cast<double>(beam);
    return Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                           std::sin(elevation));
  };
  ThreadPool pool(0);
  pool.forEach(columns, [&](std::size_t column, std::size_t) {
    const auto world = [&](std::size_t beam) -> Eigen::Vector3d {
      return T_world_sensor.linear() * directionOf(column, beam);
    };
    const Eigen::Vector3d middle = world(beams / 2);
    const double spread = std::max(spreadOf(middle, world(0)), spreadOf(middle, world(beams - 1)));
    const auto shapes = shapesInFan(scene, origin, middle, time, lidar.max_range, spread);
    for (std::size_t beam = 0; beam < beams; ++beam) {
      const Eigen::Vector3d direction = world(beam);
      const std::size_t r = column * beams + beam;
      BeamDice dice(lidar.seed, scan, r);
      Return seen = cast(scene, shapes, origin, direction, time, lidar.max_range);
      if (conditions.glass && seen.label == kBuilding && seen.shape)
        seen = seenInPane(scene, seen, origin, direction, time, lidar.max_range, dice);
      seen = weather.seenThrough(seen, -direction.z(), dice);
      if (conditions.steam) {
        const double end = seen.range > 0.0 ? seen.range : lidar.max_range;
        const double range = findSteam(shapes, origin, direction, time, end, dice);
        if (range > 0.0) seen = weather.particleAt(range, dice);
      }
      returns[r] = seen;
    }
  });
  SequenceFrame frame;
  for (std::size_t r = 0; r < returns.size(); ++r) {
    if (returns[r].range == 0.0) continue;
    const double range =
        std::max(0.01, returns[r].range + lidar.range_noise * counterNormal(lidar.seed, scan, r));
    const bool wrong = !scene.shapes.empty() && counterRandom(lidar.seed, scan, r, 2) < lidar.label_noise;
    frame.points.push_back((directionOf(r / beams, r % beams) * range).cast<float>());
    frame.remissions.push_back(0.5f);
    frame.labels.push_back(wrong ? randomLabel(scene, counterRandom(lidar.seed, scan, r, 3))
                                 : returns[r].label);
  }
  return frame;
}

Drive::Drive(const DriveConfig& config)
    : config_(checked(config)),
      scene_(config.scene == SceneKind::kTrajectory
                 ? makeStreetAlong(config)
                 : makeScene(config.scene, config.speed * config.duration() + 110.0, config.duration(),
                             config.speed, config.seed)) {
  if (config.scene == SceneKind::kTrajectory) index_.emplace(scene_.shapes);
}

Eigen::Isometry3d Drive::T_world_sensor(std::size_t i) const {
  if (config_.scene == SceneKind::kRooms) return poseInRooms(config_.speed * timeOf(i), config_.height);
  if (config_.scene == SceneKind::kTrajectory) return config_.trajectory[i];
  // In the right lane, weaving slightly.
  const double x = config_.speed * timeOf(i), wave = 0.06;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(x, -1.5 + 0.3 * std::sin(wave * x), config_.height);
  T.linear() = Eigen::AngleAxisd(std::atan(0.3 * wave * std::cos(wave * x)), Eigen::Vector3d::UnitZ())
                   .toRotationMatrix();
  return T;
}

SequenceFrame Drive::frame(std::size_t i) const {
  Scene near;  // of a street along a trajectory
  if (index_) {
    const Eigen::Vector2d at = T_world_sensor(i).translation().head<2>();
    near = {scene_.ground, shapesNear(scene_.shapes, *index_, at, config_.lidar.max_range, timeOf(i))};
  }
  SequenceFrame frame = scan(index_ ? std::as_const(near) : scene_, config_.lidar, T_world_sensor(i),
                             timeOf(i), i, config_.weather);
  frame.T_map_sensor = T_world_sensor(0).inverse() * T_world_sensor(i);
  frame.stamp = Sequence::kFirstStamp + static_cast<std::uint64_t>(std::llround(timeOf(i) * 1e9));
  return frame;
}

}  // namespace bki_mapping::simulation
