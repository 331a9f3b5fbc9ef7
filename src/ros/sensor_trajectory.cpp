#include "ros/sensor_trajectory.h"

#include <algorithm>

#include "ros/pose_conversion.h"

namespace bki_mapping::ros_interface {
namespace {

Eigen::Vector3d placeOf(const SensorPose& pose) {
  return {pose.pose.position.x, pose.pose.position.y, pose.pose.position.z};
}

}  // namespace

void SensorTrajectory::append(const SensorPose& pose, double step) {
  if (poses_.size() > 1 && (placeOf(pose) - placeOf(poses_[poses_.size() - 2])).norm() < step) {
    poses_.pop_back();
  }
  if (poses_.size() == kMostPoses) poses_.erase(poses_.begin(), poses_.begin() + kMostPoses / 10);
  poses_.push_back(pose);
}

void SensorTrajectory::keepWithin(const Eigen::Vector3d& centre, double edge) {
  const auto left = [&](const SensorPose& pose) {
    return (placeOf(pose) - centre).cwiseAbs().maxCoeff() > 0.5 * edge;
  };
  poses_.erase(std::remove_if(poses_.begin(), poses_.end(), left), poses_.end());
}

void SensorTrajectory::correct(const std::vector<StampedMotion>& poses) {
  for (SensorPose& each : poses_) {
    const std::uint64_t stamp = each.stamp.toNSec();
    const auto found = std::lower_bound(poses.begin(), poses.end(), stamp,
                                        [](const StampedMotion& p, std::uint64_t s) { return p.stamp < s; });
    if (found != poses.end() && found->stamp == stamp) each.pose = toPose(found->motion);
  }
}

}  // namespace bki_mapping::ros_interface
