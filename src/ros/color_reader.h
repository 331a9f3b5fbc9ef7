/// @file Labels that are colours of the class table.
#pragma once

#include "ros/label_reader.h"

namespace bki_mapping::ros_shell {

/// For encodings rgb and bgr. Where classes share a colour, it means the one with the smallest id.
std::unique_ptr<LabelReader> makeColorReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes);

}  // namespace bki_mapping::ros_shell
