// Rigid motions, and poses between corrected keyframes.
#include "journal/corrected_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "bki_mapping/core/scan.h"
#include "journal/rigid_motion.h"

namespace bki_mapping {
namespace {

constexpr double kPi = 3.14159265358979323846;

Eigen::Isometry3d pose(double x, double y, double yaw) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, 0.0);
  return pose;
}

void expectNear(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double tolerance = 1e-9) {
  EXPECT_LT((a.matrix() - b.matrix()).cwiseAbs().maxCoeff(), tolerance) << a.matrix() << "\n\n" << b.matrix();
}

TEST(RigidMotion, ItsTwistLeadsToIt) {
  for (const double angle : {0.0, 1e-12, 1e-6, 1e-3, 0.5, 3.0}) {
    for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(1.0, -2.0, 0.5)}) {
      Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
      motion.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
      motion.translation() = Eigen::Vector3d(100.0, -3.0, 0.2);
      expectNear(motionOf(twistOf(motion)), motion, 1e-7);
    }
  }
}

/// Many small steps of a constant twist, one after another, are what the exponential stands for.
TEST(RigidMotion, IsTheProductOfSmallSteps) {
  Twist twist{{1.0, 0.5, -0.2}, {0.3, -1.0, 2.0}};
  constexpr int kSteps = 1 << 20;
  Twist step{twist.linear / kSteps, twist.angular / kSteps};
  Eigen::Isometry3d small = Eigen::Isometry3d::Identity();
  small.linear() = Eigen::AngleAxisd(step.angular.norm(), step.angular.normalized()).toRotationMatrix();
  small.translation() = step.linear;
  for (int n = kSteps; n > 1; n /= 2) small = small * small;
  expectNear(motionOf(twist), small, 1e-5);
}

TEST(RigidMotion, BetweenTwoIsAScrew) {
  // A quarter of a circle about (0, 1): half of it is at 45 degrees.
  const Eigen::Isometry3d half = between(pose(0, 0, 0), pose(1, 1, kPi / 2), 0.5);
  expectNear(half, pose(std::sin(kPi / 4), 1 - std::cos(kPi / 4), kPi / 4));
  expectNear(between(pose(0, 0, 0), pose(4, 2, 0), 0.25), pose(1, 0.5, 0));
}

TEST(RigidMotion, MovesNoPointWithinARangeFarther) {
  const Eigen::Isometry3d motion = pose(1, 0, 0.2);
  const Eigen::Vector3d place(3.0, 2.0, 0.0);
  const double most = farthestMove(motion, place, 10.0);
  double farthest = 0.0;
  for (int n = 0; n < 360; ++n) {
    const Eigen::Vector3d point =
        place + 10.0 * Eigen::Vector3d(std::cos(n * kPi / 180), std::sin(n * kPi / 180), 0.0);
    farthest = std::max(farthest, (motion * point - point).norm());
  }
  EXPECT_GE(most, farthest - 1e-12);
  EXPECT_LT(most, 1.1 * farthest);
}

std::vector<StampedMotion> straight(std::size_t count) {
  std::vector<StampedMotion> poses;
  for (std::size_t n = 0; n < count; ++n)
    poses.push_back({1000 + 100 * n, pose(static_cast<double>(n), 0, 0)});
  return poses;
}

TEST(CorrectedPath, WithoutKeyframesCorrectsNothing) {
  EXPECT_TRUE(CorrectedPath().empty());
  EXPECT_FALSE(CorrectedPath().correctionAt(5));
}

TEST(CorrectedPath, OneRigidCorrectionMovesTheWholePathWithoutBendingIt) {
  const Eigen::Isometry3d all = pose(500, -300, 1.0);
  std::vector<StampedMotion> odometry;
  for (int n = 0; n < 40; ++n) odometry.push_back({100ull * n, pose(3 * n, 0.1 * n * n, 0.07 * n)});
  std::vector<StampedMotion> keyframes;
  for (std::size_t n = 0; n < odometry.size(); n += 7) {
    keyframes.push_back({odometry[n].stamp, all * odometry[n].motion});
  }
  const CorrectedPath path(keyframes, odometry);
  for (const StampedMotion& each : odometry) {
    expectNear(path.correctionAt(each.stamp).value() * each.motion, all * each.motion, 1e-7);
  }
}

TEST(CorrectedPath, BetweenKeyframesScansMoveInProportion) {
  const std::vector<StampedMotion> odometry = straight(11);
  // The last keyframe is 1 m to the left, the first is right.
  const CorrectedPath path({{2000, pose(10, 1, 0)}, {1000, pose(0, 0, 0)}}, odometry);
  EXPECT_EQ(path.size(), 2u);
  for (std::size_t n = 0; n <= 10; ++n) {
    const double part = static_cast<double>(n) / 10;
    expectNear(path.correctionAt(odometry[n].stamp).value() * odometry[n].motion, pose(10 * part, part, 0));
  }
  expectNear(path.correctionAt(5000).value(), pose(0, 1, 0));
  expectNear(path.correctionAt(1).value(), pose(0, 0, 0));
}

TEST(CorrectedPath, KeyframesMayLieBetweenScans) {
  const CorrectedPath path({{1050, pose(0.5, 2, 0)}}, straight(3));
  expectNear(path.correctionAt(1100).value(), pose(0, 2, 0));
}

TEST(CorrectedPath, AScanAtAKeyframeHasItsPoseToTheBit) {
  std::vector<StampedMotion> odometry;
  for (int n = 0; n < 50; ++n) odometry.push_back({100ull * n, pose(0.7 * n, 0.1 * n * n, 0.07 * n)});
  std::vector<StampedMotion> keyframes;
  for (const StampedMotion& each : odometry)
    keyframes.push_back({each.stamp, pose(static_cast<double>(each.stamp), 0.25, 0.5)});
  const CorrectedPath path(keyframes, odometry);
  for (std::size_t n = 0; n < odometry.size(); ++n) {
    const Eigen::Isometry3d at = path.poseAt(odometry[n].stamp, odometry[n].motion).value();
    EXPECT_EQ(at.translation(), keyframes[n].motion.translation());
    EXPECT_EQ(roundedRotation(at), roundedRotation(keyframes[n].motion));
  }
}

TEST(CorrectedPath, KeyframesWithoutARecordedPoseAreLeftOut) {
  const std::vector<StampedMotion> recorded = straight(3);  // 1000 to 1200
  EXPECT_TRUE(CorrectedPath({{999, pose(0, 5, 0)}, {1201, pose(0, 5, 0)}}, recorded).empty());
  const CorrectedPath path({{1100, pose(1, 2, 0)}, {1300, pose(3, 9, 0)}}, recorded);
  EXPECT_EQ(path.size(), 1u) << "that of 1300 may be anywhere on the robot's way";
  expectNear(path.correctionAt(1200).value(), pose(0, 2, 0));
  EXPECT_TRUE(CorrectedPath({{1000, pose(0, 0, 0)}}, {}).empty());
  const std::vector<StampedMotion> pause = {{0, pose(0, 0, 0)},
                                            {CorrectedPath::kLongestGap + 1, pose(9, 0, 0)}};
  EXPECT_EQ(CorrectedPath({{0, pose(0, 0, 0)}, {1000, pose(0, 0, 0)}}, pause).size(), 1u);
}

TEST(CorrectedPath, NothingIsInterpolatedAcrossAJump) {
  // The recorded poses are 3 m too far left until a loop closes at 1500, and right after it.
  std::vector<StampedMotion> recorded;
  for (std::size_t n = 0; n < 10; ++n) {
    recorded.push_back({1000 + 100 * n, pose(static_cast<double>(n), n < 5 ? 3 : 0, 0)});
  }
  const auto truth = [](std::size_t n) { return pose(static_cast<double>(n), 0, 0); };
  const std::set<std::uint64_t> jumps = {1500};
  for (const std::size_t last : {4, 7}) {  // the last keyframe lies before the jump, or after it
    const CorrectedPath path({{1100, truth(1)}, {1000 + 100 * last, truth(last)}}, recorded, jumps);
    for (std::size_t n = 0; n < 10; ++n) {
      const auto at = path.poseAt(recorded[n].stamp, recorded[n].motion);
      EXPECT_EQ(at.has_value(), n < 5 || last == 7) << "where no keyframe is, scans stay";
      if (at) expectNear(*at, truth(n), 1e-6);
    }
  }
}

TEST(CorrectedPath, OfTwoKeyframesWithOneStampTheLaterCounts) {
  const CorrectedPath path({{1000, pose(0, 5, 0)}, {1000, pose(0, 1, 0)}}, straight(3));
  EXPECT_EQ(path.size(), 1u);
  expectNear(path.correctionAt(1000).value(), pose(0, 1, 0));
}

}  // namespace
}  // namespace bki_mapping
