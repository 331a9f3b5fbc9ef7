// Scans in the sensor's frame: rounded, placed.
#include "journal/sensor_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "journal/some_scan.h"

namespace bki_mapping {
namespace {

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

/// Where points need no turning, they are rounded many at a time.
TEST(SensorScan, ManyPointsAreRoundedAsEachIs) {
  constexpr float kUnit = 1.0f;  // so that the coordinates are what is rounded
  const float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  std::vector<float> numbers = {0.0f,       0.5f,       1.5f,       2.5f,         1e-30f,
                                4194303.5f, 8388607.0f, 8388609.0f, 1073741760.0f};
  for (std::size_t n = numbers.size(); n-- > 0;) numbers.push_back(std::nextafter(numbers[n], 0.0f));
  for (std::size_t n = numbers.size(); n-- > 0;) numbers.push_back(-numbers[n]);
  std::mt19937 random(9);
  const auto any = [&] { return numbers[random() % numbers.size()]; };
  Scan scan;
  while (scan.points.size() < 1300) {
    scan.points.emplace_back(any(), any(), any());
    if (scan.points.size() <= 512 || scan.points.size() > 1024)
      scan.points.back().x() = 7.5f;  // all are hits
  }
  for (const std::size_t n : {600, 700}) scan.points[n] = {1.0f, kNan, 0.0f};
  scan.points[800] = {kInf, 0.0f, 0.0f};
  scan.points[900] = {0.0f, 0x1.0p30f, 0.0f};
  scan.points[1000] = {0.0f, 0.4f, -0.4f};
  for (std::size_t n = 0; n < scan.points.size(); ++n) scan.labels.push_back(static_cast<std::uint32_t>(n));
  const RoundedScan rounded = toSensorScan(scan, Eigen::Isometry3d::Identity(), kUnit, {});
  std::vector<SensorScan::Coordinates> points;
  std::vector<std::uint32_t> labels;
  std::size_t at_sensor = 0;
  for (std::size_t n = 0; n < scan.points.size(); ++n) {
    const Eigen::Vector3f& point = scan.points[n];
    if (!(point.cwiseAbs().maxCoeff() < 0x1.0p30f) || !point.allFinite()) continue;
    const auto whole = [](float number) { return static_cast<std::int32_t>(std::round(number)); };
    points.push_back({whole(point.x()), whole(point.y()), whole(point.z())});
    labels.push_back(scan.labels[n]);
    if (points.back() != SensorScan::Coordinates{0, 0, 0}) continue;
    ++at_sensor;
    points.pop_back();
    labels.pop_back();
  }
  EXPECT_EQ(rounded.scan.points, points);
  EXPECT_EQ(rounded.scan.labels, labels);
  EXPECT_GT(at_sensor, 0u);
  EXPECT_EQ(rounded.left_out.at_sensor, at_sensor);
  EXPECT_EQ(rounded.left_out.not_finite, 3u);
  EXPECT_EQ(rounded.left_out.outside_map, 1u);
  EXPECT_EQ(rounded.left_out.points, at_sensor + 4);
}

TEST(SensorScan, IsPlacedInTheMemoryOfAnotherAsInItsOwn) {
  const Eigen::Isometry3d pose = somePose(6);
  Scan placed = someScan(pose, 7, true);
  placed.no_returns_at_max_range = true;
  placed.sensor_model.emplace();
  Scan plain = someScan(pose, 8, false);
  plain.points.resize(30);
  plain.labels.resize(30);
  plain.no_returns.clear();
  const SensorScan kept = toSensorScan(plain, pose, kQuantum, {}).scan;
  place(kept, pose, placed);
  const Scan expected = place(kept, pose);
  EXPECT_EQ(placed.origin, expected.origin);
  EXPECT_EQ(placed.points, expected.points);
  EXPECT_EQ(placed.labels, expected.labels);
  EXPECT_EQ(placed.labels_are_ids, expected.labels_are_ids);
  EXPECT_TRUE(placed.soft.empty());
  EXPECT_TRUE(placed.no_returns.empty());
  EXPECT_FALSE(placed.no_returns_at_max_range);
  EXPECT_FALSE(placed.sensor_model.has_value());
  EXPECT_EQ(placed.stamp, expected.stamp);
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

}  // namespace
}  // namespace bki_mapping
