#include "tools/sequence_messages.h"

#include "ros/cloud_conversion.h"
#include "ros/pose_conversion.h"

namespace bki_mapping::tools {

sensor_msgs::PointCloud2 cloudMessage(const SequenceFrame& frame, const FrameNames& names) {
  sensor_msgs::PointCloud2 cloud = ros_interface::makeCloud(frame.points, frame.remissions, frame.labels);
  cloud.header.frame_id = names.sensor;
  cloud.header.stamp.fromNSec(frame.stamp);
  return cloud;
}

tf2_msgs::TFMessage tfMessage(const SequenceFrame& frame, const FrameNames& names) {
  tf2_msgs::TFMessage message;
  message.transforms.resize(1);
  message.transforms[0].header.frame_id = names.map;
  message.transforms[0].header.stamp.fromNSec(frame.stamp);
  message.transforms[0].child_frame_id = names.sensor;
  message.transforms[0].transform = ros_interface::toTransform(frame.T_map_sensor);
  return message;
}

}  // namespace bki_mapping::tools
