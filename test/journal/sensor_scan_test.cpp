// Scans in the sensor's frame: rounded, placed.
#include "journal/sensor_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

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
