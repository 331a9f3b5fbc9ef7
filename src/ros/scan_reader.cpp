#include "ros/scan_reader.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "ros/cloud_conversion.h"

namespace bki_mapping::ros_interface {
namespace {

/// All points of a time slice are transformed by the pose at its middle [s]. In 1 ms a car at 100 km/h moves
/// 3 cm.
constexpr double kTimeSlice = 1e-3;
/// Maximum time between a point and the stamp of its cloud [s]; a field with larger values is not a time.
constexpr double kLongestScan = 10.0;

ros::Time later(const ros::Time& stamp, double seconds) {
  const double time = stamp.toSec() + seconds;
  return time > 0.0 && time < 4e9 ? stamp + ros::Duration(seconds) : stamp;
}

/// Transforms a point of the cloud to the scan: relative to its origin, in the axes of the map frame.
void moveToScan(const Eigen::Isometry3d& T_map_cloud, const Eigen::Vector3d& origin, Eigen::Vector3f& point) {
  point = (T_map_cloud * point.cast<double>() - origin).cast<float>();
}

/// Transforms each point by the pose at its time. @return the missing pose, if there is one.
std::optional<MissingPose> undistort(const CloudContent& content, const ros::Time& stamp,
                                     const std::string& map_frame, const std::string& frame,
                                     const PoseSource& poses, Scan& scan) {
  std::map<std::int64_t, Eigen::Isometry3d> pose_of_slice;
  scan.points = content.points;
  for (std::size_t i = 0; i < content.times.size(); ++i) {
    if (!(std::abs(content.times[i]) <= kLongestScan)) {
      throw std::invalid_argument("a point's time is " + numberText(content.times[i]) +
                                  " s from the stamp of its cloud; check time_field");
    }
    const auto slice = static_cast<std::int64_t>(std::floor(content.times[i] / kTimeSlice));
    auto pose = pose_of_slice.find(slice);
    if (pose == pose_of_slice.end()) {
      const ros::Time time = later(stamp, (static_cast<double>(slice) + 0.5) * kTimeSlice);
      const auto found = poses.find(map_frame, frame, time);
      if (!found) return poses.explain(map_frame, frame, time);
      pose = pose_of_slice.emplace(slice, found->T_target_source).first;
    }
    moveToScan(pose->second, scan.origin, scan.points[i]);
  }
  return std::nullopt;
}

}  // namespace

bool ScanReader::ready(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses) const {
  const std_msgs::Header& header = cloud.header;
  const auto known = [&](const std::string& frame, const ros::Time& stamp) {
    return poses.canFind(map_frame_, frame, stamp);
  };
  const auto stamp = timeOf(cloud, poses);
  if (!stamp || !known(header.frame_id, *stamp) || !known(sensorFrame(cloud), *stamp)) return false;
  if (input_.time_field.empty() || cloud.width == 0 || cloud.height == 0) return true;
  try {
    checkSizes(cloud);
    const FieldReader time(cloud, input_.time_field);
    const std::uint8_t* last = cloud.data.data() + std::size_t{cloud.height - 1} * cloud.row_step +
                               std::size_t{cloud.width - 1} * cloud.point_step;
    const double end = pointTime(time, last) + kTimeSlice;
    return !(end > 0.0 && end < kLongestScan) || known(header.frame_id, later(*stamp, end));
  } catch (const std::invalid_argument&) {
    return true;  // read() throws the same with the message
  }
}

std::variant<PlacedScan, MissingPose> ScanReader::read(const sensor_msgs::PointCloud2& cloud,
                                                       const PoseSource& poses) const {
  const std_msgs::Header& header = cloud.header;
  const std::string sensor_frame = sensorFrame(cloud);
  const ros::Time stamp = timeOf(cloud, poses).value_or(header.stamp);
  const auto sensor = poses.find(map_frame_, sensor_frame, stamp);
  if (!sensor) return poses.explain(map_frame_, sensor_frame, stamp);
  const auto frame = poses.find(map_frame_, header.frame_id, stamp);
  if (!frame) return poses.explain(map_frame_, header.frame_id, stamp);

  CloudContent content = readCloud(cloud, input_, classes_, label_values_);
  PlacedScan placed;
  Scan& scan = placed.scan;
  if (sensor_frame == header.frame_id && content.times.empty()) {
    scan = scanFromSensorFrame(sensor->T_target_source, content.points, {}, 0);
  } else {
    scan.origin = sensor->T_target_source.translation();
    if (content.times.empty()) {
      scan.points = content.points;
      for (Eigen::Vector3f& point : scan.points) moveToScan(frame->T_target_source, scan.origin, point);
    } else if (const auto missing =
                   undistort(content, sensor->stamp, map_frame_, header.frame_id, poses, scan)) {
      return *missing;
    }
  }
  const Eigen::Matrix3f rotation = frame->T_target_source.linear().cast<float>();
  for (const Eigen::Vector3f& direction : content.no_returns) scan.no_returns.push_back(rotation * direction);
  scan.stamp = sensor->stamp.toNSec();  // of the cloud; of the latest pose if the cloud has none
  scan.labels = std::move(content.labels.labels);
  scan.labels_are_ids = content.labels.are_ids;
  scan.soft = std::move(content.labels.soft);
  scan.sensor_model = input_.sensor_model;
  scan.no_returns_at_max_range = input_.clear_no_returns;
  placed.T_map_sensor = sensor->T_target_source;
  placed.unlisted_labels = std::move(content.labels.unknown);
  return placed;
}

}  // namespace bki_mapping::ros_interface
