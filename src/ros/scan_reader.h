/// @file Makes scans from clouds and tf.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <optional>
#include <string>
#include <variant>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "core/frame_name.h"
#include "core/unlisted_labels.h"
#include "ros/input_config.h"
#include "ros/no_returns.h"
#include "ros/point_times.h"
#include "ros/pose_source.h"

namespace bki_mapping::ros_interface {

/// The axes of a scan's points and directions. A journal rounds scans in those of the sensor, so that what it
/// keeps does not depend on the pose.
enum class ScanAxes { kMap, kSensor };

/// A scan, and the pose of the sensor.
struct PlacedScan {
  Scan scan;                       ///< in the axes that the reader was told
  Eigen::Isometry3d T_map_sensor;  ///< at the cloud's stamp
  std::string times;               ///< how the times of points were read by `auto` settings; "": not so
  UnlistedLabels unlisted_labels;
  std::optional<NoDirection> no_direction;  ///< why directions of beams without a return are not known
};

/// Reads the clouds of one input.
class ScanReader {
 public:
  /// @param classes must outlive the reader.
  ScanReader(const InputConfig& input, const std::string& map_frame, const ClassTable& classes,
             LabelValues label_values, ScanAxes axes = ScanAxes::kMap)
      : input_(input),
        map_frame_(frameName(map_frame)),
        classes_(classes),
        label_values_(label_values),
        axes_(axes) {}

  /// The scan of a cloud, or why its pose is missing; the pose may become available later.
  /// @param now the time on this computer, for the explanation; 0: not known.
  /// @throws std::invalid_argument in one sentence if the cloud lacks fields that the input's settings name,
  /// or if these fields cannot be what the settings say.
  std::variant<PlacedScan, MissingPose> read(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses,
                                             const ros::Time& now = {}) const;

  /// Whether read() would return a scan, or throw. Cheaper than read().
  /// @param times keeps what has been read of the cloud until the next call; empty at first.
  bool ready(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses,
             std::optional<TimeValues>& times) const;
  bool ready(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses) const {
    std::optional<TimeValues> times;
    return ready(cloud, poses, times);
  }

  /// Whether the origin of the beams is doubtful: the cloud is in the map frame, and sensor_frame_id is not
  /// set.
  bool originDoubtful(const sensor_msgs::PointCloud2& cloud) const {
    return input_.sensor_frame_id.empty() && frameName(cloud.header.frame_id) == map_frame_;
  }
  /// The frame at whose origin the beams of a cloud start.
  std::string sensorFrame(const sensor_msgs::PointCloud2& cloud) const {
    return frameName(input_.sensor_frame_id.empty() ? cloud.header.frame_id : input_.sensor_frame_id);
  }
  const InputConfig& input() const { return input_; }
  const std::string& mapFrame() const { return map_frame_; }

 private:
  /// The time at which the poses of a cloud are looked up: its stamp, or, for a stamp of 0, the latest time
  /// at which both frames have a pose, so that both poses are of the same time. nullopt if there is no such
  /// time.
  std::optional<ros::Time> timeOf(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses) const {
    if (!cloud.header.stamp.isZero()) return cloud.header.stamp;
    return poses.latestCommon(map_frame_, sensorFrame(cloud), frameName(cloud.header.frame_id));
  }

  InputConfig input_;
  std::string map_frame_;
  const ClassTable& classes_;
  LabelValues label_values_;
  ScanAxes axes_;
};

}  // namespace bki_mapping::ros_interface
