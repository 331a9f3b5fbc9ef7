// Scans in the sensor's frame: rounded, placed, packed.
#include "journal/sensor_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "journal/random_motion.h"
#include "journal/scan_codec.h"

namespace bki_mapping {
namespace {

constexpr double kQuantum = 0.01;

Eigen::Isometry3d somePose(unsigned seed) {
  std::mt19937 random(seed);
  return randomMotion(random, 50.0, 3.0);
}

/// A scan with hits, some of which no map can hold, in the axes of the map.
Scan someScan(const Eigen::Isometry3d& pose, unsigned seed, bool soft) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-40.0f, 40.0f);
  std::vector<Eigen::Vector3f> points;
  for (int n = 0; n < 500; ++n) {
    const float x = uniform(random), y = uniform(random), z = uniform(random);
    points.emplace_back(x, y, z);
  }
  std::vector<std::uint32_t> labels;
  for (std::size_t n = 0; n < points.size(); ++n)
    labels.push_back(static_cast<std::uint32_t>(n % 3 + (n % 7 << 16)));
  Scan scan = scanFromSensorFrame(pose, points, labels, 123456789012345);
  if (soft) {
    scan.labels_are_ids = true;
    for (std::size_t n = 0; n < points.size(); ++n) {
      scan.soft.startPoint();
      for (std::size_t c = 0; c < n % 4; ++c)
        scan.soft.add({static_cast<ClassId>(c), 1.0f / static_cast<float>(n % 4)});
    }
  }
  for (int n = 0; n < 20; ++n) scan.no_returns.emplace_back(uniform(random), uniform(random), 1.0f);
  scan.no_returns.emplace_back(0.0f, 0.0f, 0.0f);
  return scan;
}

TEST(SensorScan, PlacedWhereItWasItIsTheSameWithinTheQuantum) {
  for (const bool soft : {false, true}) {
    const Eigen::Isometry3d pose = somePose(1);
    const Scan scan = someScan(pose, 2, soft);
    const RoundedScan rounded = toSensorScan(scan, pose, kQuantum, {});
    EXPECT_EQ(rounded.left_out.points, 0u);
    const Scan placed = place(rounded.scan, pose);
    ASSERT_EQ(placed.points.size(), scan.points.size());
    EXPECT_EQ(placed.origin, scan.origin);
    for (std::size_t n = 0; n < scan.points.size(); ++n) {
      EXPECT_LT((placed.points[n] - scan.points[n]).norm(), 0.87f * kQuantum + 1e-5f);
    }
    EXPECT_EQ(placed.labels, scan.labels);
    EXPECT_EQ(placed.labels_are_ids, scan.labels_are_ids);
    EXPECT_EQ(placed.stamp, scan.stamp);
    ASSERT_EQ(placed.soft.size(), scan.soft.size());
    for (std::size_t n = 0; n < placed.soft.size(); ++n) {
      ASSERT_EQ(placed.soft.end(n) - placed.soft.begin(n), scan.soft.end(n) - scan.soft.begin(n));
      for (auto a = placed.soft.begin(n), b = scan.soft.begin(n); a != placed.soft.end(n); ++a, ++b) {
        EXPECT_EQ(a->id, b->id);
        EXPECT_NEAR(a->share, b->share, SensorScan::kShareUnit);
      }
    }
    ASSERT_EQ(placed.no_returns.size(), scan.no_returns.size());
    for (std::size_t n = 0; n + 1 < scan.no_returns.size(); ++n) {
      EXPECT_LT((placed.no_returns[n].normalized() - scan.no_returns[n].normalized()).norm(), 2e-4f);
    }
    EXPECT_TRUE(placed.no_returns.back().isZero(0.0f)) << "a beam whose direction is not known";
  }
}

TEST(SensorScan, PlacedElsewhereItMovesAsARigidBody) {
  const Eigen::Isometry3d from = somePose(3), to = somePose(4);
  const Scan scan = someScan(from, 5, false);
  const Scan placed = place(toSensorScan(scan, from, kQuantum, {}).scan, to);
  EXPECT_EQ(placed.origin, to.translation());
  for (std::size_t n = 0; n < scan.points.size(); ++n) {
    const Eigen::Vector3d in_sensor = from.inverse() * (scan.origin + scan.points[n].cast<double>());
    EXPECT_LT((placed.origin + placed.points[n].cast<double>() - to * in_sensor).norm(), kQuantum);
  }
}

TEST(SensorScan, WhatNoMapCanHoldIsCounted) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                  kInf = std::numeric_limits<float>::infinity();
  Scan scan;
  scan.points = {
      {1.0f, 0.0f, 0.0f}, {kNan, 0.0f, 0.0f}, {0.0f, -kInf, 0.0f}, {1e-3f, 0.0f, 2e-3f}, {1e30f, 0.0f, 0.0f}};
  scan.labels.assign(scan.points.size(), 7);
  const RoundedScan rounded = toSensorScan(scan, Eigen::Isometry3d::Identity(), kQuantum, {});
  EXPECT_EQ(rounded.scan.points.size(), 1u);
  EXPECT_EQ(rounded.left_out.points, 4u);
  EXPECT_EQ(rounded.left_out.not_finite, 2u);
  EXPECT_EQ(rounded.left_out.at_sensor, 1u);
  EXPECT_EQ(rounded.left_out.outside_map, 1u);
  scan.labels.pop_back();
  EXPECT_THROW(toSensorScan(scan, Eigen::Isometry3d::Identity(), kQuantum, {}), std::invalid_argument);
}

TEST(SensorScan, PointsAtTheSensorsRangeStayBeamsWithoutAReturn) {
  SensorModelConfig sensor;
  sensor.max_range = 20.0;
  Scan scan;
  scan.points = {{20.0f, 0.0f, 0.0f}, {0.0f, 12.0f, 16.001f}, {19.9f, 0.0f, 0.0f}};
  scan.labels = {1, 1, 1};
  scan.no_returns_at_max_range = true;
  scan.sensor_model = sensor;
  const Scan placed =
      place(toSensorScan(scan, Eigen::Isometry3d::Identity(), 0.05, {}).scan, Eigen::Isometry3d::Identity());
  ASSERT_EQ(placed.points.size(), 1u);
  EXPECT_NEAR(placed.points[0].x(), 19.9f, 0.05f);
  ASSERT_EQ(placed.no_returns.size(), 2u);
  EXPECT_LT((placed.no_returns[1] - Eigen::Vector3f(0.0f, 0.6f, 0.8f)).norm(), 1e-3f);
}

TEST(SensorScan, ItsReachIsThatOfItsBeams) {
  SensorScan scan;
  scan.quantum = 0.5;
  scan.points = {{2, 0, 0}, {0, -6, 8}};
  EXPECT_DOUBLE_EQ(reachOf(scan, {}), 5.0);
  scan.no_returns = {{0, 0, 1}};
  SensorModelConfig sensor;
  sensor.max_range = 30.0;
  EXPECT_DOUBLE_EQ(reachOf(scan, sensor), 30.0);
  sensor.max_range = 3.0;
  EXPECT_DOUBLE_EQ(reachOf(scan, sensor), 3.0);
}

TEST(ScanCodec, UnpacksWhatItPacks) {
  for (const bool soft : {false, true}) {
    SensorScan scan = toSensorScan(someScan(somePose(6), 7, soft), somePose(6), kQuantum, {}).scan;
    EXPECT_EQ(unpackScan(packScan(scan)), scan);
    scan.sensor_model = SensorModelConfig{0.5, 80.0, 1.7};
    scan.points.push_back(
        {std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::min(), 0});
    scan.labels.push_back(0xffffffffu);
    if (soft) scan.soft_counts.push_back(0);
    EXPECT_EQ(unpackScan(packScan(scan)), scan);
  }
  SensorScan without_points;
  without_points.quantum = 0.1;
  EXPECT_EQ(unpackScan(packScan(without_points)), without_points);
}

TEST(ScanCodec, TakesFewBytesForTheRowsOfALidar) {
  SensorScan scan;
  scan.quantum = kQuantum;
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 1000; ++column) {
      const double azimuth = column * 2e-3 * 3.14159, range = 10.0 + 5.0 * std::sin(3.0 * azimuth);
      const auto quanta = [](double metres) {
        return static_cast<std::int32_t>(std::lround(metres / kQuantum));
      };
      scan.points.push_back({quanta(range * std::cos(azimuth)), quanta(range * std::sin(azimuth)),
                             quanta(range * std::tan(0.03 * (row - 8)))});
      scan.labels.push_back(column < 500 ? 40 : 50);
    }
  }
  EXPECT_LT(packScan(scan).size(), 2 * scan.points.size());
}

TEST(ScanCodec, RefusesDamagedBytes) {
  const std::string good =
      packScan(toSensorScan(someScan(somePose(8), 9, true), somePose(8), kQuantum, {}).scan);
  std::mt19937 random(10);
  int refused = 0;
  for (int n = 0; n < 2000; ++n) {
    std::string bad = good;
    const std::size_t at = random() % (n % 2 ? 64 : bad.size());
    bad[at] = static_cast<char>(bad[at] ^ (1 << random() % 8));
    if (n % 5 == 0) bad.resize(random() % bad.size());
    try {
      unpackScan(bad);
    } catch (const ScanDamaged&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000) << "what the header says of the sensor may be anything";
  EXPECT_THROW(unpackScan(""), ScanDamaged);
  std::string greedy = good;  // claims four billion points
  for (int byte = 48; byte < 52; ++byte) greedy[static_cast<std::size_t>(byte)] = '\xff';
  EXPECT_THROW(unpackScan(greedy), ScanDamaged);
}

}  // namespace
}  // namespace bki_mapping
