/// @file Makes scans from clouds and tf.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <variant>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "core/unlisted_labels.h"
#include "ros/input_config.h"
#include "ros/pose_source.h"

namespace bki_mapping::ros_interface {

/// A scan, and the pose of the sensor.
struct PlacedScan {
  Scan scan;
  Eigen::Isometry3d T_map_sensor;  ///< at the cloud's stamp
  UnlistedLabels unlisted_labels;
};

/// Reads the clouds of one input.
class ScanReader {
 public:
  /// @param classes must outlive the reader.
  ScanReader(const InputConfig& input, const std::string& map_frame, const ClassTable& classes,
             LabelValues label_values)
      : input_(input), map_frame_(map_frame), classes_(classes), label_values_(label_values) {}

  /// The scan of a cloud, or why its pose is missing; the pose may become available later.
  /// @throws std::invalid_argument in one sentence if the cloud lacks fields that the input's settings name.
  std::variant<PlacedScan, MissingPose> read(const sensor_msgs::PointCloud2& cloud,
                                             const PoseSource& poses) const;

  /// Whether tf has the poses of the cloud. Cheaper than read().
  bool ready(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses) const;

  /// Whether the origin of the beams is doubtful: the cloud is in the map frame, and sensor_frame_id is not
  /// set.
  bool originDoubtful(const sensor_msgs::PointCloud2& cloud) const {
    return input_.sensor_frame_id.empty() && cloud.header.frame_id == map_frame_;
  }
  const InputConfig& input() const { return input_; }

 private:
  std::string sensorFrame(const sensor_msgs::PointCloud2& cloud) const {
    return input_.sensor_frame_id.empty() ? cloud.header.frame_id : input_.sensor_frame_id;
  }

  /// The time at which the poses of a cloud are looked up: its stamp, or, for a stamp of 0, the latest time
  /// at which both frames have a pose, so that both poses are of the same time. nullopt if there is no such
  /// time.
  std::optional<ros::Time> timeOf(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses) const {
    if (!cloud.header.stamp.isZero()) return cloud.header.stamp;
    return poses.latestCommon(map_frame_, sensorFrame(cloud), cloud.header.frame_id);
  }

  InputConfig input_;
  std::string map_frame_;
  const ClassTable& classes_;
  LabelValues label_values_;
};

}  // namespace bki_mapping::ros_interface
