/// @file Reads points and labels from sensor_msgs/PointCloud2.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "ros/label_reader.h"
#include "ros/no_returns.h"

namespace bki_mapping::ros_interface {

struct CloudContent {
  /// Where the points are relative to, in the cloud's frame [m]: the sensor, if the cloud has coordinates in
  /// double precision, which would be rounded far from the frame's origin; otherwise that origin.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f>
      points;                 ///< relative to `origin`, in the axes of the cloud's frame [m]; unfiltered
  CloudLabels labels;         ///< one per point
  std::vector<double> times;  ///< raw, one per point; empty without time_field
  /// Directions of the beams without a return, in the cloud's frame; 0 if not known. `points` does not
  /// contain them. Empty without clear_no_returns.
  std::vector<Eigen::Vector3f> no_returns;
  std::vector<double> no_return_times;      ///< of each of them, as `times`
  std::optional<NoDirection> no_direction;  ///< why directions are not known, if some are not
};

/// Reads a cloud with fields of any datatype, order, offset and byte order.
/// @param sensor where the beams start, in the cloud's frame.
/// @throws std::invalid_argument in one sentence: a field is missing, or fields or sizes do not match the
/// data.
CloudContent readCloud(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                       const ClassTable& classes, LabelValues label_values,
                       const Eigen::Vector3d& sensor = Eigen::Vector3d::Zero());

/// A cloud with fields x, y, z, intensity (float32) and label (uint32).
sensor_msgs::PointCloud2 makeCloud(const std::vector<Eigen::Vector3f>& points,
                                   const std::vector<float>& intensities,
                                   const std::vector<std::uint32_t>& labels);

}  // namespace bki_mapping::ros_interface
