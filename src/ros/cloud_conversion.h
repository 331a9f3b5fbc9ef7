/// @file Points and labels from sensor_msgs/PointCloud2.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ros/label_reader.h"

namespace bki_mapping::ros_shell {

struct CloudContent {
  std::vector<Eigen::Vector3f> points;  ///< in the cloud's frame [m]; not filtered
  CloudLabels labels;                   ///< one a point
  std::vector<double> times;  ///< of each point after the cloud's stamp [s]; empty without time_field
  /// Directions of beams without a return, in the cloud's frame; such points are not in `points`.
  std::vector<Eigen::Vector3f> no_returns;
};

/// Reads a cloud. Fields may have any datatype, order, offset and byte order.
/// @throws std::invalid_argument in one sentence: a field is missing, fields or sizes do not fit the data.
CloudContent readCloud(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                       const ClassTable& classes, LabelValues label_values);

/// The time of a point after the cloud's stamp [s]. @param time a reader of time_field.
double pointTime(const FieldReader& time, const std::uint8_t* point);

/// A cloud with fields x, y, z, intensity (float32) and label (uint32).
sensor_msgs::PointCloud2 makeCloud(const std::vector<Eigen::Vector3f>& points,
                                   const std::vector<float>& intensities,
                                   const std::vector<std::uint32_t>& labels);

}  // namespace bki_mapping::ros_shell
