// The trajectory is bounded: by the window, and where the robot drives round and round in it.
#include "ros/sensor_trajectory.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bki_mapping::ros_interface {
namespace {

SensorPose poseAt(double x, double y, double stamp) {
  SensorPose pose;
  pose.stamp = ros::Time(stamp);
  pose.pose.position.x = x;
  pose.pose.position.y = y;
  return pose;
}

TEST(SensorTrajectory, MergesPosesWhileTheSensorStands) {
  SensorTrajectory trajectory;
  for (int n = 0; n < 100; ++n) trajectory.append(poseAt(0.001 * n, 0.0, 1.0 + n), 0.3);
  ASSERT_EQ(trajectory.poses().size(), 2u);
  EXPECT_EQ(trajectory.poses()[1].stamp, ros::Time(100.0)) << "the last one stays";
  for (int n = 0; n < 10; ++n) trajectory.append(poseAt(1.0 + 0.5 * n, 0.0, 200.0 + n), 0.3);
  EXPECT_EQ(trajectory.poses().size(), 12u);
}

TEST(SensorTrajectory, KeepsPosesWithinTheWindow) {
  SensorTrajectory trajectory;
  for (int n = 0; n < 100; ++n) trajectory.append(poseAt(n, 0.0, 1.0 + n), 0.3);
  trajectory.keepWithin({99.0, 0.0, 0.0}, 20.0);
  ASSERT_EQ(trajectory.poses().size(), 11u);
  EXPECT_EQ(trajectory.poses().front().pose.position.x, 89.0);
}

TEST(SensorTrajectory, ForgetsTheOldestPosesOfARobotThatGoesRoundAndRound) {
  SensorTrajectory trajectory;
  std::size_t most = 0;
  const int scans = 3 * static_cast<int>(SensorTrajectory::kMostPoses);
  for (int n = 0; n < scans; ++n) {
    trajectory.append(poseAt(10.0 * std::cos(0.1 * n), 10.0 * std::sin(0.1 * n), 1.0 + n), 0.3);
    most = std::max(most, trajectory.poses().size());
  }
  EXPECT_EQ(most, SensorTrajectory::kMostPoses);
  const auto& poses = trajectory.poses();
  EXPECT_GE(poses.size(), SensorTrajectory::kMostPoses * 9 / 10);
  EXPECT_EQ(poses.back().stamp, ros::Time(scans));
  EXPECT_EQ(poses.back().stamp.sec - poses.front().stamp.sec + 1, poses.size()) << "a pose is missing";
}

}  // namespace
}  // namespace bki_mapping::ros_interface
