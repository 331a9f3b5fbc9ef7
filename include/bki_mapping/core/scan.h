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

namespace bki_mapping {

/// How near to max_range a point is at it, as a share of max_range: 1 cm at 100 m, more than clouds round by.
constexpr double kAtMaxRange = 1e-4;

/// The hits of one sweep. Points are kept relative to the sensor so that single precision is enough
/// however far the map's origin is away.
struct Scan {
  /// Sensor origin in the map frame [m]; where the beams start.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// Hits relative to `origin`, in the axes of the map frame [m].
  std::vector<Eigen::Vector3f> points;
  /// The label of each hit, as `label_values` says; as long as `points`.
  std::vector<std::uint32_t> labels;
  /// Whether `labels` are ids of the class table, whatever `label_values` says.
  bool labels_are_ids = false;
  /// Shares of the classes in each hit; empty where labels are all there is. Else `labels` holds ids.
  SoftLabels soft;
  /// Directions of beams that met nothing up to the sensor's range, in the axes of the map frame; any length.
  std::vector<Eigen::Vector3f> no_returns;
  /// Whether points at max_range (within kAtMaxRange of it) met nothing either: some drivers put them there.
  bool no_returns_at_max_range = false;
  /// Ranges of the sensor, where they are not those of the mapper's settings.
  std::optional<SensorModelConfig> sensor_model;
  /// Time of the scan [ns]. Seeds the random free-space samples: scans drawn at the same time and with the
  /// same seed draw the same numbers, whatever their order.
  std::uint64_t stamp = 0;
};

/// What the labels of a scan are that is judged without a mapper's settings.
inline LabelValues labelValues(const Scan& scan) {
  return scan.labels_are_ids ? LabelValues::kId : LabelValues::kRaw;
}

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
