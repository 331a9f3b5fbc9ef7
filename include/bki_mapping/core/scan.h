/// @file One labelled lidar scan.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/sensor_model.h"
#include "bki_mapping/core/soft_labels.h"
#include "bki_mapping/core/span.h"

namespace bki_mapping {

/// Relative tolerance for treating a point as being at max_range (1 cm at 100 m); covers drivers' rounding.
constexpr double kAtMaxRange = 1e-4;

/// The hits of one sweep. Points are relative to the sensor, so that single precision is enough however far
/// the sensor is from the map's origin.
struct Scan {
  /// Sensor origin in the map frame [m], where the beams start.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// Hits relative to `origin`, in the axes of the map frame [m].
  std::vector<Eigen::Vector3f> points;
  /// The label of each hit, encoded as `label_values` says; as long as `points`.
  std::vector<std::uint32_t> labels;
  /// Whether `labels` are ids of the class table; overrides `label_values`.
  bool labels_are_ids = false;
  /// The probabilities of the classes for each hit. Empty if there are only hard labels; otherwise `labels`
  /// holds ids.
  SoftLabels soft;
  /// Directions of beams without a return, in the axes of the map frame; of any length > 0.
  std::vector<Eigen::Vector3f> no_returns;
  /// Whether points at max_range (within kAtMaxRange) mean that the beam had no return: some drivers report
  /// it so.
  bool no_returns_at_max_range = false;
  /// Range limits of the sensor; without a value, those of the mapper's settings.
  std::optional<SensorModelConfig> sensor_model;
  /// Time of the scan [ns]. With the seed it determines the random free samples, so that these do not depend
  /// on the order of the scans.
  std::uint64_t stamp = 0;
};

/// A scan that does not own its points and labels; a message or a NumPy array may hold them. The members have
/// the meanings of those of Scan. Valid as long as the data that it refers to.
struct ScanView {
  ScanView() = default;
  ScanView(const Scan& scan)
      : origin(scan.origin),
        points(scan.points),
        labels(scan.labels),
        labels_are_ids(scan.labels_are_ids),
        soft(scan.soft.empty() ? nullptr : &scan.soft),
        no_returns(scan.no_returns),
        no_returns_at_max_range(scan.no_returns_at_max_range),
        sensor_model(scan.sensor_model),
        stamp(scan.stamp) {}

  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Span<const Eigen::Vector3f> points;
  Span<const std::uint32_t> labels;
  bool labels_are_ids = false;
  const SoftLabels* soft = nullptr;  ///< nullptr if there are only hard labels
  Span<const Eigen::Vector3f> no_returns;
  bool no_returns_at_max_range = false;
  std::optional<SensorModelConfig> sensor_model;
  std::uint64_t stamp = 0;
};

/// How the labels of a scan are encoded where no mapper's settings apply.
inline LabelValues labelValues(const Scan& scan) {
  return scan.labels_are_ids ? LabelValues::kId : LabelValues::kRaw;
}

/// The rotation of a pose, rounded to 2^-30 (0.1 um at 100 m), so that a pose gives the same map to the bit
/// whether it comes from a file or, interpolated, from tf.
inline Eigen::Matrix3f roundedRotation(const Eigen::Isometry3d& T_map_sensor) {
  constexpr double kStep = 0x1.0p-30;
  return ((T_map_sensor.linear() / kStep).array().round() * kStep).matrix().cast<float>();
}

/// Makes a scan from points in the sensor frame.
/// @param T_map_sensor pose of the sensor in the map frame. @param points in the sensor frame [m].
inline Scan scanFromSensorFrame(const Eigen::Isometry3d& T_map_sensor,
                                const std::vector<Eigen::Vector3f>& points, std::vector<std::uint32_t> labels,
                                std::uint64_t stamp) {
  Scan scan;
  scan.origin = T_map_sensor.translation();
  scan.labels = std::move(labels);
  scan.stamp = stamp;
  const Eigen::Matrix3f rotation = roundedRotation(T_map_sensor);
  scan.points.reserve(points.size());
  for (const Eigen::Vector3f& point : points) scan.points.push_back(rotation * point);
  return scan;
}

}  // namespace bki_mapping
