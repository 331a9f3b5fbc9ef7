// The rooms: the robot gets through, people and the door keep to their places, and a lidar near the floor
// sees table tops from below, thin legs and cables.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "simulation/furniture.h"
#include "simulation/lidar.h"
#include "simulation/rooms.h"

namespace bki_mapping::simulation {
namespace {

constexpr std::uint64_t kSeeds = 12;

bool slides(const Shape& shape) {
  return shape.label == kMovingVehicle && shape.hinge.isZero();
}
bool isWardrobeDoor(const Shape& shape) {
  return shape.label == kMovingVehicle && !shape.hinge.isZero();
}

/// Whether a shape comes within a distance of an upright line. @param low, high ends of the line [m].
bool isNear(Shape shape, double time, const Eigen::Vector2d& at, double low, double high, double distance) {
  shape.half.head<2>().array() += distance;
  const double z = std::clamp(shape.centreAt(time).z(), low, high);
  return shape.contains({at.x(), at.y(), z}, time);
}

/// A drive once through all rooms, with exact ranges.
DriveConfig oneRound(double height = 0.35) {
  DriveConfig config = usualDrive(SceneKind::kRooms);
  config.lidar.range_noise = 0.0;
  config.height = height;
  config.scans = static_cast<int>(std::ceil(roundThroughRooms() / config.speed * config.lidar.rate));
  return config;
}

/// Calls visit(point in the world, label, time) for the points of every 20th scan.
template <typename Visit>
void forEachPoint(const DriveConfig& config, Visit&& visit) {
  const Drive drive(config);
  for (std::size_t i = 0; i < drive.size(); i += 20) {
    const SequenceFrame frame = drive.frame(i);
    for (std::size_t p = 0; p < frame.points.size(); ++p)
      visit(drive.T_world_sensor(i) * frame.points[p].cast<double>(), frame.labels[p], drive.timeOf(i));
  }
}

TEST(Rooms, TheRoundIsSmoothAndClosed) {
  const double round = roundThroughRooms();
  EXPECT_GT(round, 30.0);
  EXPECT_LT(round, 35.0);
  Eigen::Isometry3d before = poseInRooms(0.0, 0.35);
  double turned = 0.0;
  for (double way = 0.01; way < 2.0 * round; way += 0.01) {
    const Eigen::Isometry3d pose = poseInRooms(way, 0.35);
    const Eigen::Matrix3d turn = before.linear().transpose() * pose.linear();
    EXPECT_NEAR((pose.translation() - before.translation()).norm(), 0.01, 0.002) << way;
    const double angle = std::atan2(turn(1, 0), turn(0, 0));
    EXPECT_LT(std::abs(angle), 0.03) << way;
    turned += angle;
    before = pose;
  }
  EXPECT_NEAR(turned, -4.0 * M_PI, 0.1) << "twice round, to the right";
  EXPECT_LT((poseInRooms(round, 0.35).translation() - poseInRooms(0.0, 0.35).translation()).norm(), 0.05);
}

TEST(Rooms, TheRobotTouchesNothing) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Scene scene = makeRooms(seed);
    const double speed = usualDrive(SceneKind::kRooms).speed;
    for (double way = 0.0; way < 2.0 * roundThroughRooms(); way += 0.1) {
      const Eigen::Vector2d at = poseInRooms(way, 0.35).translation().head<2>();
      for (const Shape& shape : scene.shapes) {
        const double distance = shape.label == kMovingPerson ? 0.5 : 0.35;
        EXPECT_FALSE(isNear(shape, way / speed, at, 0.01, kDoorHeight - 0.1, distance))
            << "seed " << seed << ", label " << shape.label << " at " << shape.centre.transpose()
            << ", robot at " << at.transpose();
      }
    }
  }
}

TEST(Rooms, PeopleWalkAndStandAndTouchNothing) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Scene scene = makeRooms(seed);
    int walkers = 0;
    for (const Shape& part : scene.shapes) {
      if (part.label != kMovingPerson) continue;
      ++walkers;
      double stands = 0.0, longest = 0.0, farthest = 0.0, fastest = 0.0;
      constexpr double kStep = 0.1;
      for (double time = 0.0; time < part.period; time += kStep) {
        const Eigen::Vector3d at = part.centreAt(time), next = part.centreAt(time + kStep);
        stands = at.isApprox(next, 1e-9) ? stands + kStep : 0.0;
        longest = std::max(longest, stands);
        farthest = std::max(farthest, (at - part.centre).norm());
        fastest = std::max(fastest, (next - at).norm() / kStep);
        for (const Shape& other : scene.shapes) {
          if (other.label == kMovingPerson) continue;
          EXPECT_FALSE(isNear(other, time, at.head<2>(), at.z() - part.half.z(), at.z() + part.half.z(),
                              part.half.x() - 0.01))
              << "seed " << seed << ": label " << other.label << " at " << other.centre.transpose()
              << ", person at " << at.transpose();
        }
      }
      EXPECT_GT(longest, 2.0);
      EXPECT_GT(farthest, 1.0);
      EXPECT_GT(fastest, 0.4);
      EXPECT_LT(fastest, 1.3);
      EXPECT_TRUE(part.centreAt(1.7).isApprox(part.centreAt(1.7 + 3.0 * part.period), 1e-6));
    }
    EXPECT_EQ(walkers, 6 * 4) << "six people of four parts";
    EXPECT_EQ(std::count_if(scene.shapes.begin(), scene.shapes.end(),
                            [](const Shape& shape) { return shape.label == kPerson; }),
              4);
  }
}

TEST(Rooms, TheSlidingDoorOpensAndCloses) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Scene scene = makeRooms(seed);
    const auto door = std::find_if(scene.shapes.begin(), scene.shapes.end(), slides);
    ASSERT_NE(door, scene.shapes.end());
    EXPECT_EQ(std::count_if(scene.shapes.begin(), scene.shapes.end(), slides), 1);
    double least = 1e9, most = -1e9, closed = 0.0, open = 0.0;
    int closings = 0;
    bool was_closed = false;
    for (double time = 0.0; time < 2.0 * door->period; time += 0.1) {
      const Eigen::Vector3d at = door->centreAt(time);
      EXPECT_NEAR((at - door->centre).tail<2>().norm(), 0.0, 1e-9) << "it slides along the wall";
      least = std::min(least, at.x());
      most = std::max(most, at.x());
      // Right behind the opening, from its left to its right end.
      int filled = 0;
      for (const double aside : {-0.4, 0.0, 0.4}) {
        const auto label = scene.labelAt({least + aside, at.y(), 1.0}, time);
        filled += label && *label == kMovingVehicle;
      }
      const bool is_closed = std::abs(at.x() - 12.2) < 1e-6;
      if (is_closed) {
        EXPECT_EQ(filled, 3) << time;
      }
      closings += is_closed && !was_closed;
      was_closed = is_closed;
      closed += is_closed ? 0.1 : 0.0;
      open += at.x() - 12.2 > 0.99 ? 0.1 : 0.0;
    }
    EXPECT_NEAR(least, 12.2, 1e-6);
    EXPECT_NEAR(most, 13.2, 1e-6);
    EXPECT_GE(closings, 4) << "twice in each period";
    EXPECT_GT(closed, 6.0);
    EXPECT_GT(open, 6.0);
  }
}

TEST(Rooms, TheWardrobeDoorTurnsAboutItsHinge) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Scene scene = makeRooms(seed);
    const auto door = std::find_if(scene.shapes.begin(), scene.shapes.end(), isWardrobeDoor);
    ASSERT_NE(door, scene.shapes.end());
    const Eigen::Vector2d hinge = door->centre.head<2>() + door->hinge;
    double closed = 0.0, open = 0.0;
    for (double time = 0.0; time < door->period; time += 0.1) {
      const Eigen::Vector2d arm = door->centreAt(time).head<2>() - hinge;
      EXPECT_NEAR(arm.norm(), door->hinge.norm(), 1e-9);
      const double angle = std::acos(-arm.x() / arm.norm());
      EXPECT_GE(arm.y(), -1e-9) << "into the room";
      closed += angle < 1e-3 ? 0.1 : 0.0;
      open += angle > 1.79 ? 0.1 : 0.0;
      // The furniture behind and the person before it are in nobody's way.
      for (const double part : {0.1, 0.5, 1.0, 1.5, 1.99}) {
        const Eigen::Vector2d at = hinge + part * arm;
        for (const Shape& shape : scene.shapes) {
          if (isWardrobeDoor(shape)) continue;
          EXPECT_FALSE(shape.contains({at.x(), at.y(), 1.0}, time)) << time << ", label " << shape.label;
        }
      }
    }
    EXPECT_GT(closed, 5.0);
    EXPECT_GT(open, 2.0);
  }
}

TEST(Rooms, BeamsEndOnSurfacesWithinTheFlat) {
  DriveConfig config = oneRound();
  config.lidar.columns = 600;
  const Drive drive(config);
  std::size_t points = 0, amiss = 0, inside = 0;
  for (std::size_t i = 0; i < drive.size(); i += 60) {
    const SequenceFrame frame = drive.frame(i);
    const auto beams = static_cast<std::size_t>(config.lidar.beams * config.lidar.columns);
    EXPECT_EQ(frame.points.size(), beams) << "nothing gets out of the flat";
    for (std::size_t p = 0; p < frame.points.size(); ++p) {
      const Eigen::Vector3d to = frame.points[p].cast<double>(), beyond = 0.001 * to.normalized();
      const Eigen::Isometry3d T = drive.T_world_sensor(i);
      const Eigen::Array3d at = (T * to).array();
      EXPECT_TRUE((at > Eigen::Array3d(kFlatFrom[0], kFlatFrom[1], kFlatFrom[2]) - 1e-3).all()) << at;
      EXPECT_TRUE((at < Eigen::Array3d(kFlatTo[0], kFlatTo[1], kCeiling + 1e-3)).all()) << at;
      const auto label = drive.scene().labelAt(T * (to + beyond), drive.timeOf(i));
      amiss += label != frame.labels[p];
      inside += drive.scene().labelAt(T * (to - beyond), drive.timeOf(i)).has_value();
      ++points;
    }
  }
  EXPECT_GT(points, 80000u);
  EXPECT_EQ(inside, 0u);
  EXPECT_LT(static_cast<double>(amiss), 1e-3 * static_cast<double>(points)) << "beams that graze edges";
}

TEST(Rooms, ALowLidarSeesTableTopsFromBelowLegsAndCables) {
  std::map<std::uint32_t, std::size_t> points;
  std::size_t below = 0, above = 0, chair_legs = 0, table_legs = 0, hanging = 0, rod = 0, lying = 0,
              ceiling = 0, floor_amiss = 0;
  forEachPoint(oneRound(), [&](const Eigen::Vector3d& at, std::uint32_t label, double) {
    ++points[label];
    below += label == kTable && std::abs(at.z() - (kTableHeight - kTableTop)) < 1e-4;
    above += label == kTable && std::abs(at.z() - kTableHeight) < 1e-4;
    table_legs += label == kTable && at.z() < 0.35;
    chair_legs += label == kChair && at.z() < 0.42;
    hanging += label == kThin && at.z() > 1.5 + 1e-4;
    rod += label == kThin && at.z() < kTableHeight - 1e-4;
    lying += label == kSmall && at.z() < 0.021;
    ceiling += label == kWall && std::abs(at.z() - kCeiling) < 1e-4;
    floor_amiss += label == kFloor && std::abs(at.z()) > 1e-4;
  });
  EXPECT_GT(below, 1000u);
  EXPECT_LT(above, below / 100) << "only by their edges";
  EXPECT_GT(table_legs, 200u);
  EXPECT_GT(chair_legs, 1000u);
  EXPECT_GT(hanging, 20u);
  EXPECT_GT(rod, 20u);
  EXPECT_GT(lying, 100u);
  EXPECT_GT(ceiling, 20u);
  EXPECT_EQ(floor_amiss, 0u);
  for (const std::uint32_t label : {kFloor, kWall, kTable, kChair, kFurniture, kThin, kSmall, kTrolley,
                                    kPerson, kMovingPerson, kMovingVehicle}) {
    EXPECT_GT(points[label], 100u) << label;
  }
  EXPECT_EQ(points.size(), 11u) << "no other label";
}

TEST(Rooms, ALidarAboveTheTablesSeesThemFromAbove) {
  std::size_t below = 0, above = 0;
  forEachPoint(oneRound(1.3), [&](const Eigen::Vector3d& at, std::uint32_t label, double) {
    below += label == kTable && std::abs(at.z() - (kTableHeight - kTableTop)) < 1e-4;
    above += label == kTable && std::abs(at.z() - kTableHeight) < 1e-4;
  });
  EXPECT_GT(above, 1000u);
  EXPECT_LT(below, above / 100) << "only by their edges";
}

TEST(Rooms, TheSeedDeterminesFurnitureAndPeopleButNoWalls) {
  const auto frameOf = [](std::uint64_t seed) {
    DriveConfig config = oneRound();
    config.seed = seed;
    return Drive(config).frame(37);
  };
  const SequenceFrame frame = frameOf(3);
  EXPECT_EQ(frame.points, frameOf(3).points);
  EXPECT_EQ(frame.labels, frameOf(3).labels);
  EXPECT_NE(frame.points, frameOf(4).points);
  const Scene a = makeRooms(3), b = makeRooms(4);
  std::size_t walls = 0, tables = 0;
  const auto placesOf = [](const Scene& scene, std::uint32_t label) {
    std::vector<Eigen::Vector3d> places;
    for (const Shape& shape : scene.shapes) {
      if (shape.label == label) places.push_back(shape.centre);
    }
    return places;
  };
  const auto some = placesOf(a, kWall), others = placesOf(b, kWall);
  walls = some.size();
  EXPECT_EQ(some, others);
  EXPECT_GT(walls, 40u);
  const auto some_tables = placesOf(a, kTable), other_tables = placesOf(b, kTable);
  tables = some_tables.size();
  ASSERT_EQ(tables, other_tables.size());
  EXPECT_EQ(tables, 7u * 5u);
  for (std::size_t i = 0; i < tables; ++i) EXPECT_NE(some_tables[i], other_tables[i]);
}

TEST(Rooms, AreSeenFromALowRobotUnlessAskedOtherwise) {
  const DriveConfig usual = usualDrive(SceneKind::kRooms);
  EXPECT_EQ(usual.lidar.beams, 16);
  EXPECT_EQ(usual.height, 0.35);
  EXPECT_EQ(usual.speed, 0.5);
  DriveConfig config = usual;
  config.height = 1.9;
  EXPECT_NO_THROW(checkDrive(config));
  config.height = 2.0;
  EXPECT_THROW(checkDrive(config), std::invalid_argument) << "not through the doors";
  EXPECT_EQ(usualDrive(SceneKind::kStreet).height, DriveConfig().height);
}

}  // namespace
}  // namespace bki_mapping::simulation
