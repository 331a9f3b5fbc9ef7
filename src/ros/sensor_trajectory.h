/// @file Where the sensor has been.
#pragma once

#include <cstddef>
#include <vector>

#include "journal/corrected_path.h"
#include "ros/server_snapshot.h"

namespace bki_mapping::ros_interface {

/// The poses of the sensor at integrated scans, in their order.
class SensorTrajectory {
 public:
  /// Bounds the memory, also of a robot that drives round and round in its window: 15 km at 0.3 m.
  static constexpr std::size_t kMostPoses = 50'000;

  /// Adds a pose; the oldest ones go when there are too many. A pose goes if those before and after it are
  /// less than `step` apart, so that a robot that stands still has two, not thousands. @param step [m].
  void append(const SensorPose& pose, double step);
  /// Removes the poses outside of a cube. @param centre map frame [m]. @param edge [m].
  void keepWithin(const Eigen::Vector3d& centre, double edge);
  /// Replaces the poses of scans that have moved. @param poses of scans in the map frame, by rising stamp.
  void correct(const std::vector<StampedMotion>& poses);
  void clear() { poses_.clear(); }
  const std::vector<SensorPose>& poses() const { return poses_; }

 private:
  std::vector<SensorPose> poses_;
};

}  // namespace bki_mapping::ros_interface
