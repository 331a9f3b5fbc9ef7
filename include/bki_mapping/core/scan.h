/// @file One labelled lidar scan, what it consists of, and the exception for a scan that was refused.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// The range limits of a sensor.
struct SensorModelConfig {
  double min_range = 0.0;   ///< hits closer than this are dropped [m]
  double max_range = -1.0;  ///< hits beyond this do not occupy voxels [m]; -1: not known
  /// Of the sensor above level ground [m]; 0: found from the hits of classes flagged ground. Only used by
  /// RulesConfig::enabled.
  double height = 0.0;

  /// With an unknown max_range, points beyond this are taken for faults of the driver [m]: they neither
  /// occupy nor clear. Lidars see up to about 250 m, but a corrupt point may lie anywhere.
  static constexpr double kFarthest = 300.0;
  bool knowsRange() const { return max_range > 0.0; }
  double reach() const { return knowsRange() ? max_range : kFarthest; }  ///< range of the farthest hit [m]
};

/// Relative tolerance for treating a point as being at max_range (1 cm at 100 m); covers drivers' rounding.
constexpr double kAtMaxRange = 1e-4;
/// Whether a range [m] is max_range (within kAtMaxRange); false if max_range is not known.
inline bool isAtMaxRange(const SensorModelConfig& sensor, double range) {
  return sensor.knowsRange() && std::abs(range - sensor.max_range) <= kAtMaxRange * sensor.max_range;
}

/// The probability of one class for a point.
struct ClassShare {
  ClassId id;
  float share;  ///< probability, > 0
};

/// Whether a share is a probability > 0, within rounding; other values could make evidence infinite.
inline bool isProbability(float share) {
  return share > 0.0f && share <= 1.001f;
}

/// The shares of the classes for each point of a scan. Those of a point sum to 1, or it has none.
class SoftLabels {
 public:
  bool empty() const { return begin_.empty(); }  ///< whether there are no points
  std::size_t size() const { return begin_.size(); }

  void clear() {
    begin_.clear();
    shares_.clear();
  }
  /// Starts a new point.
  void startPoint() { begin_.push_back(shares_.size()); }
  /// Adds a class to the last point.
  void add(const ClassShare& share) { shares_.push_back(share); }

  const ClassShare* begin(std::size_t point) const { return shares_.data() + begin_[point]; }
  const ClassShare* end(std::size_t point) const {
    return shares_.data() + (point + 1 < begin_.size() ? begin_[point + 1] : shares_.size());
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<ClassShare> shares_;
};

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
  /// Directions of beams without a return, in the axes of the map frame; of any length > 0, or
  /// 0 if the direction is not known: such beams are only counted.
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

/// A scan was refused; what() says why and what to do. The map is as it was before the scan.
class ScanRefused : public std::runtime_error {
 public:
  enum class Reason {
    kTooLarge,  ///< it would touch more blocks, or take more samples, than the limits allow
    kMemory,    ///< it would exceed memory_limit or the computer's memory
  };

  ScanRefused(Reason reason, const std::string& sentence) : std::runtime_error(sentence), reason_(reason) {}
  Reason reason() const { return reason_; }

 private:
  Reason reason_;
};

}  // namespace bki_mapping
