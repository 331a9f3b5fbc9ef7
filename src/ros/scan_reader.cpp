#include "ros/scan_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "ros/cloud_conversion.h"

namespace bki_mapping::ros_interface {
namespace {

/// All points of a time slice are transformed by the pose at its middle [s]. In 1 ms a car at 100 km/h moves
/// 3 cm.
constexpr double kTimeSlice = 1e-3;

std::int64_t sliceOf(double after_stamp) {
  return static_cast<std::int64_t>(std::floor(after_stamp / kTimeSlice));
}

ros::Time later(const ros::Time& stamp, double seconds) {
  const double time = stamp.toSec() + seconds;
  return time > 0.0 && time < 4e9 ? stamp + ros::Duration(seconds) : stamp;
}

/// Transforms points and directions of a cloud to those of a scan.
class ScanFrame {
 public:
  ScanFrame(const Eigen::Isometry3d& T_map_sensor, ScanAxes axes)
      : origin_(T_map_sensor.translation()),
        turns_(axes == ScanAxes::kSensor),
        R_sensor_map_(T_map_sensor.linear().transpose()) {}

  /// @param point relative to `cloud_origin`, in the axes of the cloud's frame.
  void take(const Eigen::Isometry3d& T_map_cloud, const Eigen::Vector3d& cloud_origin,
            Eigen::Vector3f& point) const {
    const Eigen::Vector3d in_map = T_map_cloud * (point.cast<double>() + cloud_origin) - origin_;
    point = (turns_ ? R_sensor_map_ * in_map : in_map).cast<float>();
  }
  Eigen::Matrix3f rotation(const Eigen::Isometry3d& T_map_cloud) const {
    if (!turns_) return T_map_cloud.linear().cast<float>();
    return (R_sensor_map_ * T_map_cloud.linear()).cast<float>();
  }

 private:
  Eigen::Vector3d origin_;
  bool turns_;
  Eigen::Matrix3d R_sensor_map_;
};

/// The time at which the pose of a slice is looked up: its middle.
ros::Time timeOfSlice(const ros::Time& stamp, std::int64_t slice) {
  return later(stamp, (static_cast<double>(slice) + 0.5) * kTimeSlice);
}

/// The poses of a cloud's frame during a scan.
class PosesOfScan {
 public:
  /// @param of_cloud the pose at the cloud's stamp.
  PosesOfScan(const PoseSource& poses, const std::string& map_frame, const std::string& frame,
              const StampedPose& of_cloud, const TimeReading& reading, const ros::Time& now)
      : poses_(poses),
        map_frame_(map_frame),
        frame_(frame),
        of_cloud_(of_cloud),
        reading_(reading),
        now_(now) {}

  const Eigen::Isometry3d& ofCloud() const { return of_cloud_.T_target_source; }
  /// The pose at a raw time; that of the cloud if the time is none of a scan. @return nullptr if the pose is
  /// missing, which `missing` explains.
  const Eigen::Isometry3d* at(double raw) {
    const double seconds = reading_.afterStamp(raw, of_cloud_.stamp);
    if (!(std::abs(seconds) <= kLongestScan)) return &of_cloud_.T_target_source;
    const std::int64_t slice = sliceOf(seconds);
    auto pose = of_slice_.find(slice);
    if (pose == of_slice_.end()) {
      const ros::Time time = timeOfSlice(of_cloud_.stamp, slice);
      const auto found = poses_.find(map_frame_, frame_, time);
      if (!found) {
        missing = poses_.explain(map_frame_, frame_, time, now_);
        return nullptr;
      }
      pose = of_slice_.emplace(slice, found->T_target_source).first;
    }
    return &pose->second;
  }

  std::optional<MissingPose> missing;

 private:
  const PoseSource& poses_;
  const std::string& map_frame_;
  const std::string& frame_;
  StampedPose of_cloud_;
  TimeReading reading_;
  ros::Time now_;
  std::map<std::int64_t, Eigen::Isometry3d> of_slice_;
};

/// Transforms each point, and each direction, by the pose at its time. Points that need no time take that of
/// the cloud, so that those at the sensor stay there. A point whose time is not finite becomes NaN, so that
/// it is counted among those. Directions at times without a pose take that of the cloud: drivers may write
/// any time where nothing came back. @return the missing pose of a point, if there is one.
std::optional<MissingPose> undistort(const CloudContent& content, const ScanFrame& frame, PosesOfScan& poses,
                                     Scan& scan) {
  scan.points = content.points;
  const Eigen::Vector3f zero = (-content.origin).cast<float>();
  for (std::size_t i = 0; i < content.times.size(); ++i) {
    Eigen::Vector3f& point = scan.points[i];
    if (!needsTime(point, zero)) {
      frame.take(poses.ofCloud(), content.origin, point);
    } else if (!std::isfinite(content.times[i])) {
      point.setConstant(std::numeric_limits<float>::quiet_NaN());
    } else if (const Eigen::Isometry3d* const pose = poses.at(content.times[i])) {
      frame.take(*pose, content.origin, point);
    } else {
      return poses.missing;
    }
  }
  scan.no_returns = content.no_returns;
  for (std::size_t i = 0; i < content.no_return_times.size(); ++i) {
    if (scan.no_returns[i].isZero()) continue;
    const Eigen::Isometry3d* const pose = poses.at(content.no_return_times[i]);
    scan.no_returns[i] = frame.rotation(pose ? *pose : poses.ofCloud()) * scan.no_returns[i];
  }
  return std::nullopt;
}

/// @throws std::invalid_argument if hardly any return is as near as a sensor can see, and they are at
/// different ranges: some drivers write one far range where nothing came back.
void checkMetres(const Scan& scan, const SensorModelConfig& sensor) {
  constexpr float kAtSensor = 1e-3f;
  constexpr double kFewInReach = 0.01;
  const double farthest = std::max(SensorModelConfig::kFarthest, sensor.max_range);
  std::vector<float> ranges;
  for (const Eigen::Vector3f& point : scan.points) {
    const float range = point.norm();
    if (std::isfinite(range) && range > kAtSensor) ranges.push_back(range);
  }
  const auto near = std::count_if(ranges.begin(), ranges.end(),
                                  [&](float range) { return static_cast<double>(range) <= farthest; });
  if (ranges.empty() || static_cast<double>(near) >= kFewInReach * static_cast<double>(ranges.size())) return;
  constexpr float kSame = 0.999f;
  const float longest = *std::max_element(ranges.begin(), ranges.end());
  const auto farthest_of_all =
      std::count_if(ranges.begin(), ranges.end(), [&](float range) { return range >= kSame * longest; });
  if (2 * farthest_of_all > static_cast<std::ptrdiff_t>(ranges.size())) return;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  throw std::invalid_argument("its points are " + numberText(std::round(static_cast<double>(*middle))) +
                              " m from the sensor (median), and hardly one is nearer than " +
                              numberText(farthest) +
                              " m; publish clouds in metres, not millimetres, correct tf, or set "
                              "sensor_model/max_range to what the sensor sees");
}

}  // namespace

bool ScanReader::ready(const sensor_msgs::PointCloud2& cloud, const PoseSource& poses,
                       std::optional<TimeValues>& times) const {
  const std::string frame = frameName(cloud.header.frame_id);
  const auto stamp = timeOf(cloud, poses);
  if (!stamp || !poses.canFind(map_frame_, frame, *stamp) ||
      !poses.canFind(map_frame_, sensorFrame(cloud), *stamp)) {
    return false;
  }
  if (input_.time_field.empty() || cloud.width == 0 || cloud.height == 0) return true;
  try {
    if (!times) times = timeValues(cloud, input_.time_field);
    if (!times->any) return true;
    const TimeReading reading = readingOf(*times, input_, *stamp);
    const auto known = [&](double raw) {
      const std::int64_t slice = sliceOf(reading.afterStamp(raw, *stamp));
      return poses.canFind(map_frame_, frame, timeOfSlice(*stamp, slice));
    };
    return known(times->low) && known(times->high);
  } catch (const std::invalid_argument&) {
    return true;  // read() throws the same with the message
  }
}

std::variant<PlacedScan, MissingPose> ScanReader::read(const sensor_msgs::PointCloud2& cloud,
                                                       const PoseSource& poses, const ros::Time& now) const {
  const std::string cloud_frame = frameName(cloud.header.frame_id), sensor_frame = sensorFrame(cloud);
  const ros::Time stamp = timeOf(cloud, poses).value_or(cloud.header.stamp);
  const auto sensor = poses.find(map_frame_, sensor_frame, stamp);
  if (!sensor) return poses.explain(map_frame_, sensor_frame, stamp, now);
  const auto frame = poses.find(map_frame_, cloud_frame, stamp);
  if (!frame) return poses.explain(map_frame_, cloud_frame, stamp, now);

  const bool one_frame = sensor_frame == cloud_frame;
  const Eigen::Vector3d beams_start =
      one_frame ? Eigen::Vector3d::Zero()
                : Eigen::Vector3d(frame->T_target_source.inverse() * sensor->T_target_source.translation());
  CloudContent content = readCloud(cloud, input_, classes_, label_values_, beams_start);
  PlacedScan placed;
  Scan& scan = placed.scan;
  scan.origin = sensor->T_target_source.translation();
  const ScanFrame scan_frame(sensor->T_target_source, axes_);
  if (!input_.time_field.empty()) {
    const TimeValues times = timeValues(cloud, input_.time_field);
    const TimeReading reading = readingOf(times, input_, sensor->stamp);
    PosesOfScan poses_of_scan(poses, map_frame_, cloud_frame, {frame->T_target_source, sensor->stamp},
                              reading, now);
    if (const auto missing = undistort(content, scan_frame, poses_of_scan, scan)) return *missing;
    const bool automatic =
        input_.time_unit == TimeUnit::kAuto || input_.time_reference == TimeReference::kAuto;
    if (automatic && times.any) placed.times = reading.text();
  } else {
    if (one_frame && axes_ == ScanAxes::kSensor) {
      scan.points = content.points;
    } else if (one_frame) {
      scan = scanFromSensorFrame(sensor->T_target_source, content.points, {}, 0);
    } else {
      scan.points = content.points;
      for (Eigen::Vector3f& point : scan.points) {
        scan_frame.take(frame->T_target_source, content.origin, point);
      }
    }
    const Eigen::Matrix3f rotation = scan_frame.rotation(frame->T_target_source);
    for (const Eigen::Vector3f& way : content.no_returns) scan.no_returns.push_back(rotation * way);
  }
  checkMetres(scan, input_.sensor_model);
  scan.stamp = sensor->stamp.toNSec();  // of the cloud; of the latest pose if the cloud has none
  scan.labels = std::move(content.labels.labels);
  scan.labels_are_ids = content.labels.are_ids;
  scan.soft = std::move(content.labels.soft);
  scan.sensor_model = input_.sensor_model;
  scan.no_returns_at_max_range = input_.clear_no_returns;
  placed.T_map_sensor = sensor->T_target_source;
  placed.unlisted_labels = std::move(content.labels.unknown);
  placed.no_direction = content.no_direction;
  return placed;
}

}  // namespace bki_mapping::ros_interface
