/// @file A scan as a journal keeps it: in the axes of the sensor, rounded to whole quanta.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "bki_mapping/core/scan.h"
#include "bki_mapping/mapping/scan_stats.h"

namespace bki_mapping {

/// A scan that can be placed anywhere. What is mapped is what is kept: with a journal, a scan goes through
/// toSensorScan() and place() before it is integrated, so that a later pose needs nothing but another
/// place().
struct SensorScan {
  using Coordinates = std::array<std::int32_t, 3>;
  /// Directions of beams without a return are multiples of this.
  static constexpr float kDirectionUnit = 0x1.0p-14f;
  /// Shares of classes are multiples of this.
  static constexpr float kShareUnit = 0x1.0p-15f;

  double quantum = 0.0;             ///< [m]
  std::vector<Coordinates> points;  ///< hits in the sensor's frame [quanta]
  /// The members that follow have the meanings of those of Scan.
  std::vector<std::uint32_t> labels;
  bool labels_are_ids = false;
  std::vector<std::uint8_t> soft_counts;   ///< number of classes of each hit; empty: only hard labels
  std::vector<ClassId> soft_ids;           ///< of all hits, one after another
  std::vector<std::uint16_t> soft_shares;  ///< [kShareUnit]
  std::vector<Coordinates> no_returns;     ///< in the sensor's frame [kDirectionUnit]; unit vectors or 0
  std::optional<SensorModelConfig> sensor_model;
  std::uint64_t stamp = 0;  ///< [ns]

  bool operator==(const SensorScan& other) const;
};

/// A rounded scan, and what could not be part of it.
struct RoundedScan {
  SensorScan scan;
  Eigen::Isometry3d T_map_sensor;  ///< where it belongs: roundedPose() of the given one
  PointCounts left_out;            ///< points that no map can hold, by the reasons of the preprocessor
};

/// A pose whose translation is rounded to kPoseStep, so that rounding errors of a calculation do not show in
/// it. (place() rounds rotations, too.)
Eigen::Isometry3d roundedPose(const Eigen::Isometry3d& pose);
constexpr double kPoseStep = 0x1.0p-20;  ///< [m]; 1 um

/// Rounds a scan to multiples of a quantum in the sensor's frame, which moves a hit by at most 0.87 quanta.
/// Points at max_range that mean a beam without a return (Scan::no_returns_at_max_range) become directions,
/// because rounding would hide what they mean.
/// @param T_map_sensor the pose of the sensor; its translation is the scan's origin. @param quantum [m], > 0.
/// @param sensor range limits of scans that bring none.
/// @throws std::invalid_argument if the numbers of points, labels and soft labels differ.
RoundedScan toSensorScan(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor, double quantum,
                         const SensorModelConfig& sensor);

/// The scan, placed at a pose of the sensor. Equal arguments give equal scans, to the bit.
Scan place(const SensorScan& kept, const Eigen::Isometry3d& T_map_sensor);
/// The same, into the memory of an earlier scan.
void place(const SensorScan& kept, const Eigen::Isometry3d& T_map_sensor, Scan& placed);

/// The farthest hit, or end of a beam without a return [m]. @param sensor as for toSensorScan().
double reachOf(const SensorScan& scan, const SensorModelConfig& sensor);

}  // namespace bki_mapping
