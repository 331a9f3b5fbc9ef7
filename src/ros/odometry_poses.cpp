#include "ros/odometry_poses.h"

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {

OdometryPoses::Pose OdometryPoses::of(const std::string& sensor_frame, std::uint64_t stamp,
                                      const Eigen::Isometry3d& T_map_sensor) {
  if (isMapFrame()) return {T_map_sensor, false, ""};
  const ros::Time time = ros::Time().fromNSec(stamp);
  if (const auto pose = poses_.find(frame_, sensor_frame, time)) {
    const bool is_first = !T_odometry_map_;
    T_odometry_map_ = pose->T_target_source * T_map_sensor.inverse();
    return {pose->T_target_source, is_first, ""};
  }
  return {T_odometry_map_ ? *T_odometry_map_ * T_map_sensor : T_map_sensor, false,
          "odometry_frame_id '" + frame_ + "': tf has no pose of '" + sensor_frame + "' in it at time " +
              numberText(time.toSec()) + "; set it to the frame of the odometry, or leave it empty (" +
              poses_.explain(frame_, sensor_frame, time).why + ")"};
}

}  // namespace bki_mapping::ros_interface
