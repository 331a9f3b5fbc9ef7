// A jump of tf is told from motion, slow corrections, pauses and jumps of time.
#include "ros/tf_jumps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "ros/pose_conversion.h"

namespace bki_mapping::ros_interface {
namespace {

constexpr double kPi = 3.14159265358979323846;

Eigen::Isometry3d at(double x, double y = 0.0, double yaw = 0.0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(Eigen::Vector3d(x, y, 0.0)).rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  return T;
}

geometry_msgs::TransformStamped stamped(double time, const Eigen::Isometry3d& T,
                                        const std::string& child = "base") {
  geometry_msgs::TransformStamped t;
  t.header.frame_id = "map";
  t.header.stamp = ros::Time(1000.0 + time);
  t.child_frame_id = child;
  t.transform = toTransform(T);
  return t;
}

/// The jumps in 10 s of poses at a rate. @param sensor its place on the robot.
std::vector<TfJump> jumpsIn(const std::function<Eigen::Isometry3d(double)>& pose, double rate = 10.0,
                            const Eigen::Vector3d& sensor = Eigen::Vector3d::Zero()) {
  TfJumpWatch watch;
  watch.watch("base", sensor);
  for (int n = 0; n < 10 * static_cast<int>(rate); ++n) watch.add(stamped(n / rate, pose(n / rate)));
  return watch.take();
}

TEST(TfJumps, MotionIsNone) {
  EXPECT_TRUE(jumpsIn([](double t) { return at(20.0 * t); }).empty()) << "20 m/s";
  EXPECT_TRUE(jumpsIn([](double t) { return at(20.0 * std::max(0.0, t - 5.0)); }).empty()) << "at once";
  EXPECT_TRUE(jumpsIn([](double t) { return at(0.0, 0.0, 0.5 * kPi * t); }).empty()) << "90 degrees/s";
  EXPECT_TRUE(jumpsIn([](double t) { return at(0.0, 0.0, 0.5 * kPi * std::max(0.0, t - 5.0)); }).empty());
  EXPECT_TRUE(jumpsIn([](double t) { return at(std::sin(2.0 * t), std::cos(2.0 * t), -2.0 * t); }).empty());
  EXPECT_TRUE(jumpsIn([](double t) {
                return at(t < 5.0 ? 20.0 * t : 100.0 + (20.0 - 5.0 * (t - 5.0) / 2) * (t - 5.0));
              }).empty())
      << "braking by 5 m/s^2";
  for (const double hertz : {0.5, 1.0, 2.0}) {  // a lidar in a hand
    EXPECT_TRUE(jumpsIn([&](double t) { return at(t, 0.0, 0.17 * std::sin(2.0 * kPi * hertz * t)); }).empty())
        << hertz;
  }
  EXPECT_TRUE(jumpsIn([](double t) { return at(20.0 * (t + 0.01 * std::sin(37.0 * t))); }).empty())
      << "stamps that are wrong by 10 ms";
}

TEST(TfJumps, SmallCorrectionsAreNone) {
  EXPECT_TRUE(jumpsIn([](double t) { return at(0.01 * std::floor(10.0 * t)); }).empty());
  EXPECT_TRUE(jumpsIn([](double t) { return at(0.05 * std::floor(t), 0.0, 0.005 * std::floor(t)); }).empty());
}

TEST(TfJumps, AJumpIsOneOfItsSize) {
  for (const double speed : {0.0, 1.0, 20.0}) {
    for (const double rate : {5.0, 10.0, 50.0}) {
      const auto jumps = jumpsIn([&](double t) { return at(speed * t, t < 4.95 ? 0.0 : 3.0); }, rate);
      ASSERT_EQ(jumps.size(), 1u) << speed << ", " << rate;
      EXPECT_EQ(jumps[0].parent, "map");
      EXPECT_EQ(jumps[0].child, "base");
      EXPECT_NEAR(jumps[0].distance, 3.0, 1e-6);
      EXPECT_NEAR(jumps[0].angle, 0.0, 1e-6);
      EXPECT_NEAR(jumps[0].stamp.toSec(), 1004.95, 1.0 / rate);
    }
  }
  const auto turned = jumpsIn([](double t) { return at(0.0, 0.0, t < 5.0 ? 0.0 : 0.1); });
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_NEAR(turned[0].angle, 0.1 * 180.0 / kPi, 1e-6);
  EXPECT_EQ(jumpsIn([](double t) { return at(t < 3.0 || t >= 6.0 ? 0.0 : 1.0); }).size(), 2u)
      << "there and back";
}

TEST(TfJumps, TheSensorMovesWhereADistantOriginTurns) {
  const auto turn = [](double t) { return at(0.0, 0.0, t < 5.0 ? 0.0 : 0.005); };  // 0.3 degrees
  EXPECT_TRUE(jumpsIn(turn).empty());
  const auto jumps = jumpsIn(turn, 10.0, {400.0, 0.0, 0.0});
  ASSERT_EQ(jumps.size(), 1u);
  EXPECT_NEAR(jumps[0].distance, 2.0, 0.01);
}

TEST(TfJumps, PausesAndJumpsOfTimeAreNone) {
  const auto drive = [](double t) { return at(t < 3.0 ? 2.0 * t : 6.0); };
  TfJumpWatch watch;
  watch.watch("base", Eigen::Vector3d::Zero());
  for (int n = 0; n < 100; ++n) {
    if (n < 20 || n > 60) watch.add(stamped(0.1 * n, drive(0.1 * n)));  // the robot stops meanwhile
  }
  EXPECT_TRUE(watch.take().empty());
  for (int n = 0; n < 50; ++n)
    watch.add(stamped(-500.0 + 0.1 * n, at(100.0)));  // refused by tf2 until a restart
  EXPECT_TRUE(watch.take().empty());
  watch.restart();
  for (int n = 0; n < 50; ++n) watch.add(stamped(-500.0 + 0.1 * n, at(100.0)));
  EXPECT_TRUE(watch.take().empty());
  for (int n = 0; n < 50; ++n) watch.add(stamped(0.1 * n, at(n < 30 ? 0.0 : 9.0), "other"));
  EXPECT_TRUE(watch.take().empty()) << "not on the way to the map";
}

TEST(TfJumps, StampsAtTheEndOfTimeDoNoHarm) {
  TfJumpWatch watch;
  watch.watch("base", Eigen::Vector3d::Zero());
  for (const double time : {0.0, 1.0, 2.0, 4294966290.0, 4294966295.0}) watch.add(stamped(time, at(0.0)));
  EXPECT_TRUE(watch.take().empty());
}

TEST(TfJumps, FramesWithoutEndDoNotFillTheMemory) {
  TfJumpWatch watch;
  std::size_t watched = 0;
  for (int round = 0; round < 2; ++round) {
    for (int n = 0; n < 10000; ++n) {
      watched += watch.watch("frame_" + std::to_string(n), Eigen::Vector3d::Zero()) ? 1 : 0;
    }
  }
  EXPECT_EQ(watched, 64u) << "each once";
}

}  // namespace
}  // namespace bki_mapping::ros_interface
