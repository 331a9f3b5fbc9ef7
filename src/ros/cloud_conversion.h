/// @file Reads points and labels from sensor_msgs/PointCloud2.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ros/label_reader.h"

namespace bki_mapping::ros_interface {

struct CloudContent {
  std::vector<Eigen::Vector3f> points;  ///< in the cloud's frame [m]; unfiltered
  CloudLabels labels;                   ///< one per point
  std::vector<double> times;            ///< raw, one per point; empty without time_field
  /// Directions of the beams without a return, in the cloud's frame. `points` does not contain them.
  std::vector<Eigen::Vector3f> no_returns;
};

/// Reads a cloud with fields of any datatype, order, offset and byte order.
/// @throws std::invalid_argument in one sentence: a field is missing, or fields or sizes do not match the
/// data.
CloudContent readCloud(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                       const ClassTable& classes, LabelValues label_values);

/// A cloud with fields x, y, z, intensity (float32) and label (uint32).
sensor_msgs::PointCloud2 makeCloud(const std::vector<Eigen::Vector3f>& points,
                                   const std::vector<float>& intensities,
                                   const std::vector<std::uint32_t>& labels);

}  // namespace bki_mapping::ros_interface
