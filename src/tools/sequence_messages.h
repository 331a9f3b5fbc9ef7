/// @file Frames of a sequence as ROS messages.
#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <string>

#include "bki_mapping/sequence/sequence.h"

namespace bki_mapping::tools {

struct FrameNames {
  std::string map = "map";
  std::string sensor = "velodyne";
};

/// The frame's points with intensities and raw labels, in the sensor frame.
sensor_msgs::PointCloud2 cloudMessage(const SequenceFrame& frame, const FrameNames& names);
/// The pose of the sensor in the map frame.
tf2_msgs::TFMessage tfMessage(const SequenceFrame& frame, const FrameNames& names);

}  // namespace bki_mapping::tools
