#include "journal/sensor_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace bki_mapping {
namespace {

/// Far more than any sensor sees, and less than a coordinate can hold [quanta].
constexpr float kMostQuanta = 0x1.0p30f;
constexpr std::size_t kMostClassesOfPoint = 255;

SensorScan::Coordinates rounded(const Eigen::Vector3f& vector, float unit) {
  const Eigen::Vector3f quanta = (vector / unit).array().round();
  return {static_cast<std::int32_t>(quanta.x()), static_cast<std::int32_t>(quanta.y()),
          static_cast<std::int32_t>(quanta.z())};
}

Eigen::Vector3f vectorOf(const SensorScan::Coordinates& coordinates, float unit) {
  return unit * Eigen::Vector3f(static_cast<float>(coordinates[0]), static_cast<float>(coordinates[1]),
                                static_cast<float>(coordinates[2]));
}

bool isZero(const SensorScan::Coordinates& coordinates) {
  return coordinates == SensorScan::Coordinates{0, 0, 0};
}

/// Adds the classes of a point. @return false, and adds none, if a share is no probability.
bool addShares(const ClassShare* begin, const ClassShare* end, SensorScan& scan) {
  if (static_cast<std::size_t>(end - begin) > kMostClassesOfPoint) return false;
  if (!std::all_of(begin, end, [](const ClassShare& s) { return isProbability(s.share); })) return false;
  for (const ClassShare* share = begin; share != end; ++share) {
    const float units = std::round(share->share / SensorScan::kShareUnit);
    scan.soft_ids.push_back(share->id);
    scan.soft_shares.push_back(static_cast<std::uint16_t>(std::max(units, 1.0f)));
  }
  scan.soft_counts.push_back(static_cast<std::uint8_t>(end - begin));
  return true;
}

}  // namespace

bool SensorScan::operator==(const SensorScan& o) const {
  const auto same_sensor = [](const auto& a, const auto& b) {
    return a.has_value() == b.has_value() &&
           (!a || (a->min_range == b->min_range && a->max_range == b->max_range && a->height == b->height));
  };
  return quantum == o.quantum && points == o.points && labels == o.labels &&
         labels_are_ids == o.labels_are_ids && soft_counts == o.soft_counts && soft_ids == o.soft_ids &&
         soft_shares == o.soft_shares && no_returns == o.no_returns && stamp == o.stamp &&
         same_sensor(sensor_model, o.sensor_model);
}

Eigen::Isometry3d roundedPose(const Eigen::Isometry3d& pose) {
  Eigen::Isometry3d rounded = pose;
  rounded.translation() = (pose.translation() / kPoseStep).array().round() * kPoseStep;
  return rounded;
}

RoundedScan toSensorScan(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor, double quantum,
                         const SensorModelConfig& sensor) {
  if (scan.labels.size() != scan.points.size() || (scan.soft && scan.soft->size() != scan.points.size())) {
    throw std::invalid_argument("the scan has " + std::to_string(scan.points.size()) +
                                " points, but not as many labels; give each point one label");
  }
  RoundedScan result;
  SensorScan& kept = result.scan;
  PointCounts& left_out = result.left_out;
  kept.quantum = quantum;
  kept.labels_are_ids = scan.labels_are_ids;
  result.T_map_sensor = roundedPose(T_map_sensor);
  kept.sensor_model = scan.sensor_model;
  kept.stamp = scan.stamp;
  kept.points.reserve(scan.points.size());
  kept.labels.reserve(scan.points.size());
  const SensorModelConfig& model = scan.sensor_model ? *scan.sensor_model : sensor;
  const Eigen::Matrix3f to_sensor = roundedRotation(T_map_sensor).transpose();
  const auto unit = static_cast<float>(quantum);
  const auto leaveOut = [&](std::size_t PointCounts::*reason) {
    ++left_out.points;
    ++(left_out.*reason);
  };
  const auto addDirection = [&](const Eigen::Vector3f& direction) {
    if (!direction.allFinite()) return leaveOut(&PointCounts::not_finite);
    const float length = direction.stableNorm();
    kept.no_returns.push_back(length > 0.0f ? rounded(direction / length, SensorScan::kDirectionUnit)
                                            : SensorScan::Coordinates{0, 0, 0});
  };
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3f point = to_sensor * scan.points[i];
    if (!point.allFinite()) {
      leaveOut(&PointCounts::not_finite);
    } else if (!(point.cwiseAbs().maxCoeff() < kMostQuanta * unit)) {
      leaveOut(&PointCounts::outside_map);
    } else if (scan.no_returns_at_max_range && isAtMaxRange(model, point.norm())) {
      addDirection(point);
    } else {
      const SensorScan::Coordinates quanta = rounded(point, unit);
      if (isZero(quanta)) {
        leaveOut(&PointCounts::at_sensor);
      } else if (scan.soft && !addShares(scan.soft->begin(i), scan.soft->end(i), kept)) {
        leaveOut(&PointCounts::not_finite);
      } else {
        kept.points.push_back(quanta);
        kept.labels.push_back(scan.labels[i]);
      }
    }
  }
  for (const Eigen::Vector3f& direction : scan.no_returns) addDirection(to_sensor * direction);
  return result;
}

Scan place(const SensorScan& kept, const Eigen::Isometry3d& T_map_sensor) {
  Scan scan;
  scan.origin = T_map_sensor.translation();
  const Eigen::Matrix3f rotation = roundedRotation(T_map_sensor);
  const auto unit = static_cast<float>(kept.quantum);
  scan.points.reserve(kept.points.size());
  for (const SensorScan::Coordinates& point : kept.points) {
    scan.points.push_back(rotation * vectorOf(point, unit));
  }
  scan.labels = kept.labels;
  scan.labels_are_ids = kept.labels_are_ids;
  std::size_t next = 0;
  for (const std::uint8_t count : kept.soft_counts) {
    scan.soft.startPoint();
    for (const std::size_t end = next + count; next < end; ++next) {
      scan.soft.add({kept.soft_ids[next], SensorScan::kShareUnit * kept.soft_shares[next]});
    }
  }
  scan.no_returns.reserve(kept.no_returns.size());
  for (const SensorScan::Coordinates& direction : kept.no_returns) {
    scan.no_returns.push_back(rotation * vectorOf(direction, SensorScan::kDirectionUnit));
  }
  scan.sensor_model = kept.sensor_model;
  scan.stamp = kept.stamp;
  return scan;
}

double reachOf(const SensorScan& scan, const SensorModelConfig& sensor) {
  const SensorModelConfig& model = scan.sensor_model ? *scan.sensor_model : sensor;
  double farthest = 0.0;
  for (const auto& [x, y, z] : scan.points) {
    farthest = std::max(farthest, Eigen::Vector3d(x, y, z).squaredNorm());
  }
  double reach = std::min(scan.quantum * std::sqrt(farthest), model.reach());
  if (!scan.no_returns.empty() && model.knowsRange()) reach = std::max(reach, model.max_range);
  return reach;
}

}  // namespace bki_mapping
