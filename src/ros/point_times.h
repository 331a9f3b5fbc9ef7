/// @file What the times of points mean.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <string>

#include "ros/input_config.h"

namespace bki_mapping::ros_interface {

/// Maximum time between a point and the stamp of its cloud [s]; a field with larger values is not a time.
constexpr double kLongestScan = 10.0;

/// Whether a point's time matters: drivers also write points at the sensor, or NaN, where a beam had no
/// return, with any time.
/// @param zero where the origin of the cloud's frame is.
inline bool needsTime(const Eigen::Vector3f& point, const Eigen::Vector3f& zero = Eigen::Vector3f::Zero()) {
  return point.allFinite() && point != zero;
}

/// What the raw times of a cloud tell about their unit. Only points that need a finite time count.
struct TimeValues {
  bool any = false;                      ///< whether there are such points
  double low = 0.0;                      ///< smallest time
  double high = 0.0;                     ///< largest time
  bool integer = false, single = false;  ///< datatype of the field: whole numbers, or FLOAT32
  /// Whether they are as many and as spread as in a whole scan: at least kManyTimes different ones, and not
  /// nearly all of them at one end.
  bool spread = false;
  bool falling = false;  ///< whether they fall throughout the cloud
  static constexpr std::size_t kManyTimes = 300;
};
/// @throws std::invalid_argument in one sentence if the field or the cloud's sizes are wrong.
TimeValues timeValues(const sensor_msgs::PointCloud2& cloud, const std::string& field);

/// How the times of a cloud are read.
struct TimeReading {
  TimeUnit unit = TimeUnit::kSeconds;              ///< never kAuto
  TimeReference reference = TimeReference::kScan;  ///< never kAuto
  double latest = 0.0;                             ///< the cloud's last raw time, for kScanEnd

  /// The time of a point relative to the stamp of its cloud [s].
  double afterStamp(double raw, const ros::Time& stamp) const;
  /// Such as "in us after the stamp".
  std::string text() const;
};

/// How the times of a cloud are read, by the settings and, where these are `auto`, by the times themselves.
/// Depends on nothing but this cloud, so that the order of clouds cannot change the map.
/// @throws std::invalid_argument in one sentence that names the setting, if the times leave a doubt or cannot
/// be times of a scan at this stamp.
TimeReading readingOf(const TimeValues& values, const InputConfig& input, const ros::Time& stamp);

}  // namespace bki_mapping::ros_interface
