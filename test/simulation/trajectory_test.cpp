// A street along a trajectory: nothing stands or drives on the way, however often it meets itself, and each
// pass sees the same street.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "refusal_of.h"
#include "simulation/drive_file.h"
#include "simulation/lidar.h"
#include "simulation/street_parts.h"
#include "simulation/voxel_truth.h"
#include "temporary_folder.h"

namespace bki_mapping::simulation {
namespace {

constexpr int kRound = 500;  // poses

bool isGround(std::uint32_t label) {
  return label == 40 || label == 48 || label == 72;
}
bool isMoving(std::uint32_t label) {
  return label >= 252;
}

/// A hilly figure of eight, driven twice at about 10 m/s; the sensor nods and rolls. It crosses its way in
/// the middle, and is in the second round where it was in the first.
std::vector<Eigen::Isometry3d> figureOfEight(double rise_of_second_round = 0.0) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 2 * kRound; ++i) {
    const double t = 2.0 * M_PI * (i % kRound) / kRound, a = 110.0, b = 55.0;
    const double x = a * std::sin(t), y = b * std::sin(2.0 * t);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() << x, y,
        1.73 + 0.03 * x + 0.5 * std::sin(0.05 * y) + (i < kRound ? 0.0 : rise_of_second_round);
    pose.linear() = (Eigen::AngleAxisd(std::atan2(2.0 * b * std::cos(2.0 * t), a * std::cos(t)),
                                       Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(0.03 * std::sin(9.0 * t), Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(0.05 * std::cos(7.0 * t), Eigen::Vector3d::UnitX()))
                        .toRotationMatrix();
    poses.push_back(pose);
  }
  return poses;
}

DriveConfig driveAlong(std::vector<Eigen::Isometry3d> trajectory) {
  DriveConfig config = usualDrive(SceneKind::kTrajectory);
  config.scans = static_cast<int>(trajectory.size());
  config.trajectory = std::move(trajectory);
  config.lidar.beams = 24;
  config.lidar.columns = 180;
  config.lidar.range_noise = 0.0;
  return config;
}

const Drive& eight() {
  static const Drive drive(driveAlong(figureOfEight()));
  return drive;
}

/// Distance from a point to a shape at a time, seen from above.
double distanceTo(const Shape& shape, const Eigen::Vector2d& point, double time) {
  const Shape there = shape.standingAt(time);
  const Eigen::Vector2d to = Eigen::Rotation2Dd(-there.yaw) * (point - there.centre.head<2>());
  if (shape.type != ShapeType::kBox) return to.norm() - shape.half.x();
  return (to.cwiseAbs() - shape.half.head<2>()).cwiseMax(0.0).norm();
}

bool isAtRest(const Shape& shape) {
  return shape.legs.empty() && shape.velocity.isZero();
}

TEST(Trajectory, NothingStandsOnTheWay) {
  const std::vector<Eigen::Isometry3d> poses = figureOfEight();
  double nearest = 100.0;
  for (const Shape& shape : eight().scene().shapes) {
    if (!isAtRest(shape)) continue;
    for (std::size_t i = 1; i < poses.size(); ++i) {
      for (const double part : {0.0, 0.5}) {
        const Eigen::Vector3d at =
            poses[i - 1].translation() + part * (poses[i].translation() - poses[i - 1].translation());
        const double distance = distanceTo(shape, at.head<2>(), 0.0);
        nearest = std::min(nearest, distance);
        ASSERT_GE(distance, 1.5) << "label " << shape.label << " at pose " << i;
      }
    }
  }
  EXPECT_LT(nearest, 3.0) << "the street is no wider than others";
}

TEST(Trajectory, NothingRunsIntoTheSensor) {
  const std::vector<Eigen::Isometry3d> poses = figureOfEight();
  double nearest = 100.0;
  for (double time = 0.0; time < 0.1 * static_cast<double>(poses.size() - 1); time += 0.02) {
    const auto i = static_cast<std::size_t>(10.0 * time);
    const Eigen::Vector3d at =
        poses[i].translation() +
        (10.0 * time - static_cast<double>(i)) * (poses[i + 1].translation() - poses[i].translation());
    for (const Shape& shape : eight().scene().shapes) {
      if (!shape.isThereAt(time)) continue;
      const double distance = distanceTo(shape, at.head<2>(), time);
      if (isMoving(shape.label)) nearest = std::min(nearest, distance);
      ASSERT_GE(distance, 1.5) << "label " << shape.label << " at " << time << " s";
    }
  }
  EXPECT_LT(nearest, 4.0) << "cars do meet the sensor";
}

TEST(Trajectory, TheStreetHasWhatStreetsHave) {
  std::map<std::uint32_t, int> shapes;
  for (const Shape& shape : eight().scene().shapes) ++shapes[shape.label];
  EXPECT_GT(shapes[kBuilding], 15);
  EXPECT_GT(shapes[kFence] + shapes[kVegetation], 20);
  EXPECT_GT(shapes[kTrunk], 10);
  EXPECT_GT(shapes[kPole], 5);
  EXPECT_GT(shapes[kSign], 2);
  EXPECT_GT(shapes[kCar], 20);
  EXPECT_GT(shapes[kMovingCar], 4);
  EXPECT_GT(shapes[kMovingPerson], 5);
  EXPECT_GT(shapes[kPerson], 1);
}

TEST(Trajectory, CarsComeAndGoOutOfRange) {
  int cars = 0;
  for (const Shape& shape : eight().scene().shapes) {
    if (shape.label != kMovingCar) continue;
    ++cars;
    for (const double time : {shape.appears, shape.vanishes}) {
      const double last = static_cast<double>(2 * kRound - 1);
      const auto i = static_cast<std::size_t>(std::clamp(10.0 * time, 0.0, last));
      EXPECT_GT((shape.centreAt(time) - eight().T_world_sensor(i).translation()).norm(), 78.0);
    }
    EXPECT_FALSE(shape.contains(shape.centreAt(shape.vanishes + 1.0), shape.vanishes + 1.0));
    // A car stays on the ground, and looks where it drives.
    for (double time = std::max(0.0, shape.appears) + 0.3; time < shape.vanishes - 0.5; time += 0.7) {
      const Shape now = shape.standingAt(time);
      const double ground = eight().scene().ground.heightAt(now.centre.x(), now.centre.y());
      EXPECT_GT(now.centre.z() - now.half.z() - ground, 0.1);
      EXPECT_LT(now.centre.z() + now.half.z() - ground, 1.65);
      const Eigen::Vector3d way = shape.centreAt(time + 0.1) - shape.centreAt(time - 0.1);
      EXPECT_GT(way.head<2>().normalized().dot(Eigen::Vector2d(std::cos(now.yaw), std::sin(now.yaw))), 0.95);
    }
  }
  EXPECT_GT(cars, 0);
}

TEST(Trajectory, TheGroundFollowsTheWay) {
  for (const Eigen::Isometry3d& pose : figureOfEight()) {
    const Eigen::Vector3d at = pose.translation();
    EXPECT_NEAR(at.z() - eight().scene().ground.heightAt(at.x(), at.y()), 1.73, 0.2) << at.transpose();
  }
  EXPECT_LT(eight().scene().ground.heightAt(0.0, 5000.0), -1e9) << "it ends somewhere";
}

TEST(Trajectory, BeamsEndOnSurfaces) {
  std::size_t ground = 0, points = 0, beside = 0;
  for (const std::size_t i : {0, 57, 160, 400}) {
    const SequenceFrame frame = eight().frame(i);
    const Eigen::Isometry3d T = eight().T_world_sensor(i);
    points += frame.points.size();
    for (std::size_t p = 0; p < frame.points.size(); ++p) {
      const Eigen::Vector3d hit = T * frame.points[p].cast<double>();
      const Eigen::Vector3d beam = (hit - T.translation()).normalized();
      if (isGround(frame.labels[p])) {
        ++ground;
        ASSERT_NEAR(hit.z(), eight().scene().ground.heightAt(hit.x(), hit.y()), 0.005);
        ASSERT_EQ(eight().scene().labelAt(hit + Eigen::Vector3d(0, 0, -0.01), eight().timeOf(i)),
                  frame.labels[p]);
      } else {
        const auto behind = eight().scene().shapeLabelAt(hit + 0.001 * beam, eight().timeOf(i)),
                   before = eight().scene().shapeLabelAt(hit - 0.001 * beam, eight().timeOf(i));
        beside += behind != frame.labels[p] || before;
      }
    }
  }
  EXPECT_LT(beside, points / 1000) << "only beams that graze an edge leave the shape within a millimetre";
  EXPECT_GT(ground, points / 4);
  EXPECT_LT(ground, points * 9 / 10);
}

TEST(Trajectory, TheSecondPassSeesTheStreetOfTheFirst) {
  std::size_t compared = 0, points = 0;
  for (int i = 0; i < kRound; i += 40) {
    std::map<std::array<float, 3>, std::uint32_t> first;
    const SequenceFrame before = eight().frame(static_cast<std::size_t>(i)),
                        again = eight().frame(static_cast<std::size_t>(i + kRound));
    const auto directionOf = [](const Eigen::Vector3f& p) {
      const Eigen::Vector3d d = p.cast<double>().normalized() * 1e4;
      return std::make_pair(std::lround(d.x()) * 100000 + std::lround(d.y()), std::lround(d.z()));
    };
    std::map<std::pair<long, long>, std::size_t> beam;
    for (std::size_t p = 0; p < before.points.size(); ++p) beam[directionOf(before.points[p])] = p;
    for (std::size_t p = 0; p < again.points.size(); ++p) {
      const auto same = beam.find(directionOf(again.points[p]));
      if (isMoving(again.labels[p]) || (same != beam.end() && isMoving(before.labels[same->second])))
        continue;
      ++points;
      if (same == beam.end()) continue;  // the directions of its two points have been rounded apart
      ++compared;
      ASSERT_EQ(again.labels[p], before.labels[same->second]);
      ASSERT_LT((again.points[p] - before.points[same->second]).norm(), 1e-3f);
    }
  }
  EXPECT_GT(points, 10000u);
  EXPECT_GT(compared, points * 97 / 100);
}

TEST(Trajectory, AScanOfTheShapesNearByIsThatOfAllShapes) {
  const DriveConfig config = driveAlong(figureOfEight());
  for (const std::size_t i : {3, 250, 555}) {
    const SequenceFrame near = eight().frame(i), all = scan(eight().scene(), config.lidar,
                                                            eight().T_world_sensor(i), eight().timeOf(i), i);
    ASSERT_EQ(near.labels, all.labels);
    ASSERT_EQ(near.points.size(), all.points.size());
    for (std::size_t p = 0; p < all.points.size(); ++p)
      ASSERT_LT((near.points[p] - all.points[p]).norm(), 1e-4f) << p;
  }
}

TEST(Trajectory, EqualSeedsGiveEqualDrives) {
  DriveConfig config = driveAlong(figureOfEight());
  const Drive same(config);
  ASSERT_EQ(same.scene().shapes.size(), eight().scene().shapes.size());
  for (const std::size_t i : {0, 333}) {
    EXPECT_EQ(same.frame(i).points, eight().frame(i).points);
    EXPECT_EQ(same.frame(i).labels, eight().frame(i).labels);
  }
  config.scans = 10;
  EXPECT_EQ(Drive(config).frame(9).points, eight().frame(9).points) << "fewer scans are the first ones";
  config.seed = 2;
  EXPECT_NE(Drive(config).frame(9).points, eight().frame(9).points);
}

TEST(Trajectory, ItsFilesGiveTheSameDrive) {
  const TemporaryFolder folder;
  const DriveConfig config = driveAlong(figureOfEight());
  writeDriveFile(folder / ".", config);
  const auto read = readDriveFile(folder / ".");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->scene, SceneKind::kTrajectory);
  const Drive drive(*read);
  ASSERT_EQ(drive.scene().shapes.size(), eight().scene().shapes.size());
  for (std::size_t s = 0; s < drive.scene().shapes.size(); ++s)
    ASSERT_EQ(drive.scene().shapes[s].centre, eight().scene().shapes[s].centre) << "to the bit";
  EXPECT_TRUE(drive.T_world_sensor(100).isApprox(eight().T_world_sensor(100), 1e-12));
  std::ofstream(folder / "trajectory.txt") << "1 2 3\n";
  EXPECT_THROW(readDriveFile(folder / "."), std::runtime_error);
}

TEST(Trajectory, ItsTruthHasWhatBeamsHit) {
  const GridGeometry geometry(0.3);
  const VoxelTruth truth = VoxelTruth::of(eight(), geometry);
  std::size_t hits = 0, filled = 0, free = 0;
  for (const std::size_t i : {20, 180}) {
    const SequenceFrame frame = eight().frame(i);
    for (std::size_t p = 0; p < frame.points.size(); p += 7) {
      const Eigen::Vector3d hit = frame.T_map_sensor * frame.points[p].cast<double>();
      const Eigen::Vector3d before = frame.T_map_sensor * (0.5 * frame.points[p]).cast<double>();
      ++hits;
      filled += truth.isNearAnything(geometry.voxelAt(hit), eight().timeOf(i), 0.1);
      free += !truth.contentAt(geometry.voxelAt(before), eight().timeOf(i)).label;
    }
  }
  EXPECT_EQ(filled, hits);
  EXPECT_GT(free, hits * 95 / 100);
}

TEST(Trajectory, PassesOfDifferentHeightShareTheGroundBetweenThem) {
  const Drive drive(driveAlong(figureOfEight(1.0)));
  const Eigen::Vector3d at = drive.T_world_sensor(40).translation();
  EXPECT_NEAR(at.z() - drive.scene().ground.heightAt(at.x(), at.y()), 1.73 - 0.5, 0.2);
  const std::string refusal = refusalOf([] { Drive(driveAlong(figureOfEight(4.0))); });
  EXPECT_NE(refusal.find("pose 0 of the trajectory"), std::string::npos)
      << "the sensor would be under the ground; " << refusal;
}

TEST(Trajectory, ASensorAtRestSeesAStreet) {
  std::vector<Eigen::Isometry3d> poses(5, figureOfEight().front());
  const Drive drive(driveAlong(poses));
  EXPECT_GT(drive.frame(4).points.size(), 2000u);
  EXPECT_TRUE(drive.frame(4).T_map_sensor.matrix().isApprox(Eigen::Matrix4d::Identity(), 1e-12));
}

TEST(Trajectory, AScanLooksAtNoMoreShapesOfALongStreet) {
  const auto shapesAtTheStart = [](int metres) {
    std::vector<Eigen::Isometry3d> poses;
    for (int x = 0; x < metres; ++x)
      poses.emplace_back(Eigen::Translation3d(x, 0.2 * std::sin(0.1 * x), 1.73));
    const Drive drive(driveAlong(poses));
    EXPECT_GT(drive.scene().shapes.size(), static_cast<std::size_t>(metres) / 4);
    return ShapeIndex(drive.scene().shapes).near(Eigen::Vector2d(10.0, 0.0), 80.0).size();
  };
  const std::size_t few = shapesAtTheStart(300);
  EXPECT_GT(few, 50u);
  EXPECT_LT(shapesAtTheStart(3000), 2 * few);
}

TEST(Trajectory, WrongSettingsAreRefused) {
  DriveConfig config = driveAlong(figureOfEight());
  config.scans = 2 * kRound + 1;
  EXPECT_THROW(Drive{config}, std::invalid_argument);
  config.scene = SceneKind::kStreet;
  EXPECT_THROW(Drive{config}, std::invalid_argument);
  EXPECT_THROW(Drive{usualDrive(SceneKind::kTrajectory)}, std::invalid_argument);
  config = driveAlong({figureOfEight().front(), figureOfEight().front()});
  config.trajectory.back().translation().x() += 2e5;
  EXPECT_THROW(Drive{config}, std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping::simulation
