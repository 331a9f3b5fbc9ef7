/// @file Motions of a rigid body, and what lies between two of them.
#pragma once

#include <Eigen/Geometry>

namespace bki_mapping {

/// A velocity of a rigid body times a time: of its origin [m], and of its rotation [rad].
struct Twist {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();
};

/// The motion that a constant twist leads to: the exponential of SE(3) (Barfoot, State Estimation for
/// Robotics, 2017, Equation 7.85). Its rotation is orthonormal.
Eigen::Isometry3d motionOf(const Twist& twist);

/// The shortest twist that leads to a motion: the logarithm of SE(3). @param motion with an orthonormal
/// rotation.
Twist twistOf(const Eigen::Isometry3d& motion);

/// The motion at a fraction of the way from one motion to another, along the screw that leads from one to
/// the other: a body that moves so turns and slides at constant speeds. @param fraction 0 gives `from`, 1
/// gives `to`; others than 0 to 1 are allowed.
Eigen::Isometry3d between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, double fraction);

/// How far a motion moves a point at most, if it is within a range of a place [m].
/// @param place before the motion [m].
double farthestMove(const Eigen::Isometry3d& motion, const Eigen::Vector3d& place, double range);

}  // namespace bki_mapping
