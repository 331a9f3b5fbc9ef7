// The simulation: beams end on surfaces, labels match the scene, and equal settings give equal scans.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "simulation/drive_file.h"
#include "simulation/lidar.h"
#include "temporary_folder.h"

namespace bki_mapping::simulation {
namespace {

LidarConfig smallLidar() {
  LidarConfig lidar;
  lidar.beams = 16;
  lidar.columns = 360;
  lidar.range_noise = 0.0;
  return lidar;
}

TEST(Shape, HitsOfABoxACylinderAndAnEllipsoid) {
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitX();
  Shape box{ShapeType::kBox, {10, 0, 0}, {1, 2, 3}};
  EXPECT_NEAR(*box.hit({0, 0, 0}, forward, 0.0), 9.0, 1e-12);
  EXPECT_FALSE(box.hit({0, 2.1, 0}, forward, 0.0));
  EXPECT_FALSE(box.hit({20, 0, 0}, forward, 0.0)) << "nothing behind the sensor";
  box.yaw = M_PI / 2;
  EXPECT_NEAR(*box.hit({0, 0, 0}, forward, 0.0), 8.0, 1e-9);
  Shape pillar{ShapeType::kCylinder, {10, 0, 1}, {0.5, 0.5, 1}};
  EXPECT_NEAR(*pillar.hit({0, 0, 1}, forward, 0.0), 9.5, 1e-12);
  EXPECT_FALSE(pillar.hit({0, 0, 2.1}, forward, 0.0));
  Shape ball{ShapeType::kEllipsoid, {10, 0, 0}, {2, 1, 1}};
  EXPECT_NEAR(*ball.hit({0, 0, 0}, forward, 0.0), 8.0, 1e-12);
  ball.velocity = {1, 0, 0};
  EXPECT_NEAR(*ball.hit({0, 0, 0}, forward, 3.0), 11.0, 1e-12);
  EXPECT_TRUE(ball.contains({13, 0, 0}, 3.0));
  EXPECT_FALSE(ball.contains({10, 0, 0}, 3.0));
}

TEST(Shape, GoesLegByLeg) {
  Shape car{ShapeType::kBox, {10, 0, 0}, {2, 1, 1}};
  car.legs = {{2.0, Eigen::Vector3d::Zero()}, {4.0, {0, 3, 0}}};
  car.velocity = {1, 0, 0};
  EXPECT_EQ(car.centreAt(1.5), Eigen::Vector3d(10, 0, 0));
  EXPECT_EQ(car.centreAt(3.0), Eigen::Vector3d(10, 3, 0));
  EXPECT_EQ(car.centreAt(4.0), Eigen::Vector3d(10, 6, 0));
  EXPECT_EQ(car.centreAt(9.0), Eigen::Vector3d(15, 6, 0));
}

TEST(Shape, TurnsAboutItsHinge) {
  Shape door{ShapeType::kBox, {10, 0, 1}, {0.5, 0.02, 1}};
  door.hinge = {0.5, 0.0};
  door.legs = {{1.0, Eigen::Vector3d::Zero()}, {2.0, Eigen::Vector3d::Zero(), -M_PI / 2}};
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitX(), left = Eigen::Vector3d::UnitY();
  EXPECT_NEAR(*door.hit({0, 0, 1}, forward, 1.0), 9.5, 1e-9);
  EXPECT_TRUE(door.contains({9.6, 0, 1}, 0.5));
  for (const double time : {2.0, 7.0}) {
    EXPECT_TRUE(door.centreAt(time).isApprox(Eigen::Vector3d(10.5, 0.5, 1), 1e-9)) << time;
    EXPECT_NEAR(*door.hit({0, 0.5, 1}, forward, time), 10.48, 1e-9);
    EXPECT_NEAR(*door.hit({10.5, -1, 1}, left, time), 1.0, 1e-9);
    EXPECT_FALSE(door.contains({9.6, 0, 1}, time));
    EXPECT_TRUE(door.contains({10.5, 0.9, 1}, time));
  }
  const double r = 0.9 * std::sqrt(0.5);
  EXPECT_TRUE(door.contains({10.5 - r, r, 1}, 1.5)) << "half way";
}

TEST(Shape, RepeatsItsLegs) {
  Shape person{ShapeType::kBox, {0, 0, 1}, {0.2, 0.2, 1}};
  person.legs = {{2.0, {1, 0, 0}}, {3.0, {0, 0, 0}}, {5.0, {-1, 0, 0}}};
  person.period = 6.0;
  for (const double cycle : {0.0, 6.0, 600.0, -6.0}) {
    EXPECT_NEAR(person.centreAt(cycle + 1.5).x(), 1.5, 1e-9);
    EXPECT_NEAR(person.centreAt(cycle + 2.5).x(), 2.0, 1e-9);
    EXPECT_NEAR(person.centreAt(cycle + 4.5).x(), 0.5, 1e-9);
    EXPECT_NEAR(person.centreAt(cycle + 5.5).x(), 0.0, 1e-9);
  }
}

/// The distances that the shapes with a label are from where they were at time 0, at each of the given times.
std::vector<std::vector<double>> waysOf(const Scene& scene, std::uint32_t label,
                                        const std::vector<double>& times) {
  std::vector<std::vector<double>> ways;
  for (const Shape& shape : scene.shapes) {
    if (shape.label != label) continue;
    ways.emplace_back();
    for (const double time : times) ways.back().push_back((shape.centreAt(time) - shape.centreAt(0)).norm());
  }
  return ways;
}

TEST(Scene, TrafficWaitsAndGoesAndParkedCarsDriveOff) {
  const Scene scene = makeScene(SceneKind::kTraffic, 200.0, 30.0, 3.0, 1);
  int waiting = 0, driven_off = 0;
  for (const auto& way : waysOf(scene, 252, {2.9, 7.0, 14.0, 30.0})) {
    waiting += way[2] > 0.0 && way[0] < way[1];
    driven_off += way[0] == 0.0 && way[3] > 10.0;
    EXPECT_GT(way[3], 0.0) << "what is labelled as moving moves";
  }
  EXPECT_GT(waiting, 20);
  EXPECT_GT(driven_off, 3);
  for (const auto& way : waysOf(scene, 10, {30.0})) EXPECT_EQ(way[0], 0.0);
  // The sensor drives at y = -1.5 and runs into nobody.
  for (double time = 0.0; time < 30.0; time += 0.1) {
    EXPECT_FALSE(scene.labelAt({3.0 * time, -1.5, 1.0}, time)) << time;
  }
}

TEST(Scene, AQueueCreepsAndLeavesTheSensorAlone) {
  const Scene scene = makeScene(SceneKind::kQueue, 150.0, 30.0, 0.5, 1);
  std::set<double> paces;
  for (const auto& way : waysOf(scene, 252, {2.0, 10.0, 10.1, 30.0})) {
    for (const double pace : {way[0] / 2.0, (way[2] - way[1]) / 0.1, way[3] / 30.0}) {
      EXPECT_GE(pace, 0.5 - 1e-9);
      EXPECT_LE(pace, 2.0 + 1e-9);
      paces.insert(std::round(1e3 * pace));
    }
  }
  EXPECT_GT(paces.size(), 4u) << "the pace changes, and differs from lane to lane";
  EXPECT_GT(waysOf(scene, 10, {1.0}).size(), 10u);
  for (double time = 0.0; time < 30.0; time += 0.1) {
    EXPECT_FALSE(scene.labelAt({0.5 * time, -1.5, 1.0}, time)) << time;
  }
}

TEST(Scene, ACrowdStandsAndWalks) {
  const Scene scene = makeScene(SceneKind::kCrowd, 150.0, 30.0, 2.0, 1);
  EXPECT_GT(waysOf(scene, 254, {1.0}).size(), 100u);
  EXPECT_GT(waysOf(scene, 30, {1.0}).size(), 5u);
  EXPECT_GT(waysOf(scene, 253, {1.0}).size(), 5u);
  for (const auto& way : waysOf(scene, 254, {30.0})) EXPECT_GT(way[0], 0.0);
}

bool isGate(const Shape& shape) {
  return shape.label == 259 && shape.centre.y() == 8.5;
}

TEST(Scene, GatesOpenAndCloseAgain) {
  const Scene scene = makeScene(SceneKind::kArrivals, 100.0, 60.0, 0.0, 1);
  std::size_t gates = 0;
  for (const Shape& gate : scene.shapes) {
    if (!isGate(gate)) continue;
    ++gates;
    double farthest = 0.0;
    int returns = 0;
    for (double time = 0.0, before = 0.0; time < 60.0; time += 0.1) {
      const Eigen::Vector3d way = gate.centreAt(time) - gate.centre;
      EXPECT_NEAR(way.tail<2>().norm(), 0.0, 1e-9) << "it slides along the street";
      returns += before > 0.01 && way.x() <= 0.01;
      before = way.x();
      farthest = std::max(farthest, way.x());
    }
    EXPECT_NEAR(farthest, 2.3, 0.01);
    EXPECT_GT(returns, 2);
  }
  EXPECT_GT(gates, 4u);
}

TEST(Scene, SomeWhoStopSitDownAndGetUp) {
  const Scene scene = makeScene(SceneKind::kArrivals, 100.0, 60.0, 0.0, 1);
  std::size_t sit = 0;
  for (const Shape& person : scene.shapes) {
    if (person.label != 254) continue;
    double lowest = person.centre.z();
    for (double time = 0.0; time < 60.0; time += 0.1) lowest = std::min(lowest, person.centreAt(time).z());
    if (lowest == person.centre.z()) continue;
    ++sit;
    EXPECT_NEAR(lowest, person.centre.z() - 0.6, 1e-9);
    EXPECT_NEAR(person.centreAt(60.0).z(), person.centre.z(), 1e-9);
  }
  EXPECT_GT(sit, 4u);
}

TEST(Scene, VisitorsArriveAndStayAndLeave) {
  constexpr double kDuration = 60.0;
  const Scene scene = makeScene(SceneKind::kArrivals, 100.0, kDuration, 0.0, 1);
  for (const std::uint32_t label : {252u, 254u, 259u}) {
    std::size_t come = 0, stay = 0, leave = 0;
    for (const Shape& shape : scene.shapes) {
      if (shape.label != label || isGate(shape)) continue;
      const auto moves = [&](double time) {
        return !shape.centreAt(time).isApprox(shape.centreAt(time + 0.1), 1e-6);
      };
      EXPECT_TRUE(moves(0.0));
      bool stood = false, left = false;
      for (double time = 0.0; time < kDuration; time += 0.5) {
        stood |= !moves(time);
        left |= stood && moves(time);
      }
      come += stood;
      stay += stood && !left;
      leave += left;
    }
    EXPECT_GT(come, 3u) << label;
    EXPECT_GT(stay, 0u) << label;
    EXPECT_GT(leave, 0u) << label;
  }
  EXPECT_GT(waysOf(scene, 10, {1.0}).size(), 5u) << "cars that stand all the time";
}

TEST(Lidar, HasTheRowsOfItsDataSheet) {
  struct DataSheet {
    const char* name;
    int rows;
    double lowest, highest;  // [degrees]
  };
  for (const DataSheet& sheet :
       {DataSheet{"vlp16", 16, -15.0, 15.0}, {"hdl32", 32, -30.67, 10.67}, {"hdl64", 64, -24.6, 2.3}}) {
    LidarConfig lidar = lidarNamed(sheet.name);
    lidar.columns = 180;
    lidar.range_noise = 0.0;
    std::set<int> rows;
    for (const Eigen::Vector3f& point : Drive({1, 8.0, 1, lidar}).frame(0).points) {
      const double elevation = std::asin(point.normalized().z()) * 180.0 / M_PI;
      const double row = (elevation - sheet.lowest) / (sheet.highest - sheet.lowest) * (sheet.rows - 1);
      ASSERT_NEAR(row, std::round(row), 0.15) << sheet.name;
      rows.insert(static_cast<int>(std::round(row)));
    }
    EXPECT_GE(*rows.begin(), 0) << sheet.name;
    EXPECT_LT(*rows.rbegin(), sheet.rows) << sheet.name;
    EXPECT_GT(static_cast<int>(rows.size()), sheet.rows / 2) << sheet.name;
  }
}

TEST(Lidar, UnknownNamesAreRefused) {
  EXPECT_THROW(lidarNamed("vlp17"), std::invalid_argument);
  EXPECT_THROW(sceneKindNamed("desert"), std::invalid_argument);
}

TEST(Lidar, BeamsEndWhereTheWorldBegins) {
  const Drive drive({5, 8.0, 3, smallLidar()});
  const SequenceFrame frame = drive.frame(4);
  ASSERT_GT(frame.points.size(), 1000u);
  std::size_t checked = 0;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const Eigen::Vector3d p = frame.points[i].cast<double>(), u = p.normalized();
    const Eigen::Isometry3d T = drive.T_world_sensor(4);
    const double time = drive.timeOf(4);
    EXPECT_EQ(drive.scene().labelAt(T * (p + 0.002 * u), time), frame.labels[i]) << i;
    EXPECT_FALSE(drive.scene().labelAt(T * (p - 0.002 * u), time).has_value()) << i;
    ++checked;
  }
  EXPECT_EQ(checked, frame.labels.size());
}

TEST(Lidar, SeesAllKindsOfThings) {
  std::set<std::uint32_t> labels;
  const Drive drive({20, 8.0, 1, LidarConfig()});
  for (const std::size_t i : {0u, 19u}) {
    const SequenceFrame frame = drive.frame(i);
    labels.insert(frame.labels.begin(), frame.labels.end());
  }
  for (const std::uint32_t raw : {10u, 252u, 254u, 40u, 48u, 50u, 51u, 70u, 71u, 72u, 80u, 81u}) {
    EXPECT_TRUE(labels.count(raw)) << raw;
  }
}

TEST(Lidar, NoiseIsAsAsked) {
  LidarConfig noisy = smallLidar();
  noisy.range_noise = 0.05;
  noisy.label_noise = 0.3;
  const SequenceFrame clean = Drive({1, 8.0, 1, smallLidar()}).frame(0),
                      other = Drive({1, 8.0, 1, noisy}).frame(0);
  ASSERT_EQ(clean.points.size(), other.points.size());
  double squares = 0.0, wrong = 0.0;
  for (std::size_t i = 0; i < clean.points.size(); ++i) {
    squares += std::pow(clean.points[i].norm() - other.points[i].norm(), 2);
    wrong += clean.labels[i] != other.labels[i];
  }
  const auto n = static_cast<double>(clean.points.size());
  EXPECT_NEAR(std::sqrt(squares / n), 0.05, 0.005);
  EXPECT_GT(wrong / n, 0.2);
  EXPECT_LT(wrong / n, 0.35);
}

TEST(Drive, RefusesAStreetWithoutEnd) {
  DriveConfig config{100, 8.0, 1, smallLidar()};
  config.lidar.rate = 1e-9;
  EXPECT_THROW(Drive{config}, std::invalid_argument);
}

TEST(DriveFile, IsReadAsAllUntrustedYaml) {
  const TemporaryFolder folder;
  for (const char* text : {"a: &a {b: *a}\n", "scans: 1\nscans: 2\n"}) {
    std::ofstream(folder / "simulation.yaml") << text;
    EXPECT_THROW(readDriveFile(folder / ""), std::runtime_error) << text;
  }
}

TEST(Drive, IsRepeatableAndStartsAtTheMapsOrigin) {
  const Drive a({3, 8.0, 5, smallLidar()}), b({3, 8.0, 5, smallLidar()}), c({3, 8.0, 6, smallLidar()});
  EXPECT_EQ(a.frame(2).points, b.frame(2).points);
  EXPECT_NE(a.frame(2).points, c.frame(2).points);
  EXPECT_TRUE(a.frame(0).T_map_sensor.isApprox(Eigen::Isometry3d::Identity()));
  EXPECT_EQ(a.frame(2).stamp, Sequence::kFirstStamp + 200000000);
}

}  // namespace
}  // namespace bki_mapping::simulation
