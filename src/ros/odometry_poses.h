/// @file The poses of sensors in the frame of the odometry.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "ros/pose_source.h"

namespace bki_mapping::ros_interface {

/// Finds poses in odometry_frame_id, in which they do not jump. Not thread-safe.
class OdometryPoses {
 public:
  struct Pose {
    Eigen::Isometry3d T_odometry_sensor;
    /// Whether it is the first one in odometry_frame_id: those before it are in the map frame.
    bool is_first = false;
    std::string warning;  ///< why tf has none, and what to do; "" if it has
  };

  /// @param frame odometry_frame_id; "": none, and all poses are those in the map. @param poses must outlive
  /// this.
  OdometryPoses(std::string frame, const PoseSource& poses) : frame_(std::move(frame)), poses_(poses) {}

  bool isMapFrame() const { return frame_.empty(); }
  /// The pose at the stamp [ns]; where tf lacks it, the one that follows from the last known one.
  Pose of(const std::string& sensor_frame, std::uint64_t stamp, const Eigen::Isometry3d& T_map_sensor);

 private:
  std::string frame_;
  const PoseSource& poses_;
  std::optional<Eigen::Isometry3d> T_odometry_map_;  ///< the last known one
};

}  // namespace bki_mapping::ros_interface
