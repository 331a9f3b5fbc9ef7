#include "ros/cloud_frame.h"

#include <ros/console.h>
#include <ros/time.h>

#include <cmath>

#include "bki_mapping/core/named_parameter.h"
#include "core/float_origin.h"

namespace bki_mapping::ros_interface {
namespace {

std::string coordinates(const Eigen::Vector3d& place, const char* separator) {
  return numberText(place.x()) + separator + numberText(place.y()) + separator + numberText(place.z());
}

}  // namespace

void CloudFrame::follow(const Eigen::Vector3d& place, double resolution, const std::string& map_frame) {
  if (!tooFarForFloats(place - origin_, resolution)) return;
  origin_ = floatOrigin(place, resolution);
  if (origin_.isZero(0.0)) return;
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = ros::Time::now();
  transform.header.frame_id = map_frame;
  transform.child_frame_id = name(map_frame);
  transform.transform.translation.x = origin_.x();
  transform.transform.translation.y = origin_.y();
  transform.transform.translation.z = origin_.z();
  transform.transform.rotation.w = 1.0;
  ROS_INFO("Voxels are too far from the origin of '%s' for 32-bit floats: clouds of them are sent in '%s'",
           map_frame.c_str(), transform.child_frame_id.c_str());
  if (!tf_) tf_.emplace();
  tf_->sendTransform(transform);
}

std::string CloudFrame::name(const std::string& map_frame) const {
  return origin_.isZero(0.0) ? map_frame : map_frame + "_at_" + coordinates(origin_, "_");
}

std::string farFromOriginWarning(const Eigen::Vector3d& place, double resolution,
                                 const std::string& map_frame) {
  if (!tooFarForFloats(place, resolution)) return "";
  const Eigen::Vector3d origin = floatOrigin(place, resolution);
  return "The sensor is at (" + coordinates(place.array().round().matrix(), ", ") + ") m in the map frame '" +
         map_frame + "', where 32-bit floats are " + numberText(floatSpacing(place.cwiseAbs().maxCoeff())) +
         " m apart, too coarse for voxels of " + numberText(resolution) +
         " m. The map is exact, and clouds of voxels are sent in a frame near them, but rviz and most "
         "programs for clouds calculate with such floats. Give the mapper a local map frame: set frame_id to "
         "local_map, and run: rosrun tf2_ros static_transform_publisher " +
         coordinates(origin, " ") + " 0 0 0 " + map_frame + " local_map";
}

}  // namespace bki_mapping::ros_interface
