/// @file One labelled lidar scan.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <utility>
#include <vector>

namespace bki_mapping {

/// The hits of one sweep. Points are kept relative to the sensor so that single precision is enough
/// however far the map's origin is away.
struct Scan {
  /// Sensor origin in the map frame [m]; where the beams start.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// Hits relative to `origin`, in the axes of the map frame [m].
  std::vector<Eigen::Vector3f> points;
  /// The data set's own label number of each hit; as long as `points`.
  std::vector<std::uint32_t> labels;
  /// Time of the scan [ns]. Seeds the random free-space samples: scans drawn at the same time and with the
  /// same seed draw the same numbers, whatever their order.
  std::uint64_t stamp = 0;
};

/// A scan from points of the sensor's own frame. The rotation is rounded to 2^-30 (0.1 um at 100 m), so that
/// a pose gives the same map to the bit whether it comes from a file or, interpolated, from tf.
/// @param T_map_sensor pose of the sensor in the map frame. @param points in the sensor frame [m].
inline Scan scanFromSensorFrame(const Eigen::Isometry3d& T_map_sensor,
                                const std::vector<Eigen::Vector3f>& points, std::vector<std::uint32_t> labels,
                                std::uint64_t stamp) {
  Scan scan;
  scan.origin = T_map_sensor.translation();
  scan.labels = std::move(labels);
  scan.stamp = stamp;
  constexpr double kStep = 0x1.0p-30;
  const Eigen::Matrix3f rotation =
      ((T_map_sensor.linear() / kStep).array().round() * kStep).matrix().cast<float>();
  scan.points.reserve(points.size());
  for (const Eigen::Vector3f& point : points) scan.points.push_back(rotation * point);
  return scan;
}

}  // namespace bki_mapping
