/// @file Converts poses between tf and Eigen.
#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>

#include <Eigen/Geometry>

namespace bki_mapping::ros_interface {

inline Eigen::Isometry3d toIsometry(const geometry_msgs::Transform& t) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << t.translation.x, t.translation.y, t.translation.z;
  T.linear() = Eigen::Quaterniond(t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z)
                   .normalized()
                   .toRotationMatrix();
  return T;
}

inline Eigen::Isometry3d toIsometry(const geometry_msgs::Pose& pose) {
  geometry_msgs::Transform t;
  t.translation.x = pose.position.x;
  t.translation.y = pose.position.y;
  t.translation.z = pose.position.z;
  t.rotation = pose.orientation;
  return toIsometry(t);
}

inline geometry_msgs::Transform toTransform(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  geometry_msgs::Transform t;
  t.translation.x = T.translation().x();
  t.translation.y = T.translation().y();
  t.translation.z = T.translation().z();
  t.rotation.w = q.w();
  t.rotation.x = q.x();
  t.rotation.y = q.y();
  t.rotation.z = q.z();
  return t;
}

inline geometry_msgs::Pose toPose(const Eigen::Isometry3d& T) {
  const geometry_msgs::Transform t = toTransform(T);
  geometry_msgs::Pose pose;
  pose.position.x = t.translation.x;
  pose.position.y = t.translation.y;
  pose.position.z = t.translation.z;
  pose.orientation = t.rotation;
  return pose;
}

}  // namespace bki_mapping::ros_interface
