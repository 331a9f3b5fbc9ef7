#include "journal/rigid_motion.h"

#include <cmath>

namespace bki_mapping {
namespace {

Eigen::Matrix3d crossProductWith(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

/// The left Jacobian of SO(3) (Barfoot, Equation 7.77): motionOf() moves the origin by it times the linear
/// part.
Eigen::Matrix3d leftJacobian(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  const Eigen::Matrix3d cross = crossProductWith(rotation);
  // Series where the quotients would lose digits.
  const bool small = angle < 1e-4;
  const double a2 = angle * angle;
  const double first = small ? 0.5 - a2 / 24.0 : (1.0 - std::cos(angle)) / a2;
  const double second = small ? 1.0 / 6.0 - a2 / 120.0 : (angle - std::sin(angle)) / (a2 * angle);
  return Eigen::Matrix3d::Identity() + first * cross + second * cross * cross;
}

}  // namespace

Eigen::Isometry3d motionOf(const Twist& twist) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  const double angle = twist.angular.norm();
  if (angle > 0.0) motion.linear() = Eigen::AngleAxisd(angle, twist.angular / angle).toRotationMatrix();
  motion.translation() = leftJacobian(twist.angular) * twist.linear;
  return motion;
}

Twist twistOf(const Eigen::Isometry3d& motion) {
  Twist twist;
  const Eigen::AngleAxisd rotation(motion.linear());
  twist.angular = rotation.angle() * rotation.axis();
  twist.linear = leftJacobian(twist.angular).inverse() * motion.translation();
  return twist;
}

Eigen::Isometry3d between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, double fraction) {
  if (fraction == 0.0) return from;
  if (fraction == 1.0) return to;
  Twist twist = twistOf(from.inverse() * to);
  twist.linear *= fraction;
  twist.angular *= fraction;
  return from * motionOf(twist);
}

double farthestMove(const Eigen::Isometry3d& motion, const Eigen::Vector3d& place, double range) {
  const double angle = Eigen::AngleAxisd(motion.linear()).angle();
  return (motion * place - place).norm() + 2.0 * std::sin(0.5 * angle) * range;
}

}  // namespace bki_mapping
