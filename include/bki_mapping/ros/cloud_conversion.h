/// @file Points and labels from sensor_msgs/PointCloud2.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace bki_mapping::ros_shell {

struct CloudContent {
  std::vector<Eigen::Vector3f> points;  ///< in the cloud's frame [m]; not filtered
  std::vector<std::uint32_t> labels;    ///< as many; 0xffffffff where the field holds no label number
};

/// Reads x, y, z and a label from a cloud. Fields may have any datatype, order, offset and byte order.
/// @param label_field name of the field with labels, integer or float; "" labels every point 0.
/// @throws std::invalid_argument in one sentence: a field is missing, fields or sizes do not fit the data.
CloudContent readCloud(const sensor_msgs::PointCloud2& cloud, const std::string& label_field);

/// A cloud with fields x, y, z, intensity (float32) and label (uint32).
sensor_msgs::PointCloud2 makeCloud(const std::vector<Eigen::Vector3f>& points,
                                   const std::vector<float>& intensities,
                                   const std::vector<std::uint32_t>& labels);

}  // namespace bki_mapping::ros_shell
