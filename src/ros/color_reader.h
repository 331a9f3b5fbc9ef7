/// @file Reads labels that are encoded as colours of the class table.
#pragma once

#include "ros/label_reader.h"

namespace bki_mapping::ros_interface {

/// Reader for the encodings rgb and bgr. A colour of several classes means the one with the smallest id.
std::unique_ptr<LabelReader> makeColorReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes);

}  // namespace bki_mapping::ros_interface
