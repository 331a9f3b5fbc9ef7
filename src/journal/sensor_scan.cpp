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

/// std::round of a number that the integer can hold. Not every processor has an instruction for it, and a
/// call for each coordinate takes most of the time of rounding a scan.
std::int32_t nearest(float number) {
  constexpr float kBelowHalf = 0x1.fffffep-2f;  // 0.5 would make 1 of the number below 0.5
  return static_cast<std::int32_t>(number + std::copysign(kBelowHalf, number));
}

SensorScan::Coordinates rounded(const Eigen::Vector3f& vector, float unit) {
  return {nearest(vector.x() / unit), nearest(vector.y() / unit), nearest(vector.z() / unit)};
}

bool isZero(const SensorScan::Coordinates& coordinates) {
  return coordinates == SensorScan::Coordinates{0, 0, 0};
}

/// Points that are rounded at once; they stay in the first-level cache.
constexpr std::size_t kRun = 512;

/// Rounds up to kRun points. @param limit of the coordinates [m].
/// @return false if some do not become points; then all have to be looked at one by one.
bool roundRun(Span<const Eigen::Vector3f> points, float unit, float limit,
              std::array<SensorScan::Coordinates, kRun>& run) {
  const float* const coordinates = points.begin()->data();  // of all points, without gaps
  std::int32_t* const quanta = run.front().data();
  const std::size_t count = 3 * points.size();
  int outside = 0, zeros = 0;  // counted rather than left at once, so that the loops are vectorised
  for (std::size_t n = 0; n < count; ++n) outside += std::abs(coordinates[n]) < limit ? 0 : 1;
  if (outside > 0) return false;
  for (std::size_t n = 0; n < count; ++n) quanta[n] = nearest(coordinates[n] / unit);
  // Three zeros in a row are hardly ever there, and are looked for faster than those of one point.
  for (std::size_t n = 0; n + 2 < count; ++n) {
    zeros += (quanta[n] | quanta[n + 1] | quanta[n + 2]) == 0 ? 1 : 0;
  }
  return zeros == 0 || std::none_of(run.begin(), run.begin() + points.size(), isZero);
}

Eigen::Vector3f vectorOf(const SensorScan::Coordinates& coordinates, float unit) {
  return unit * Eigen::Vector3f(static_cast<float>(coordinates[0]), static_cast<float>(coordinates[1]),
                                static_cast<float>(coordinates[2]));
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
  const float limit = kMostQuanta * unit;
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
  const auto addPoint = [&](std::size_t i) {
    const Eigen::Vector3f point = to_sensor * scan.points[i];
    if (!point.allFinite()) return leaveOut(&PointCounts::not_finite);
    if (!(point.cwiseAbs().maxCoeff() < limit)) return leaveOut(&PointCounts::outside_map);
    if (scan.no_returns_at_max_range && isAtMaxRange(model, point.norm())) return addDirection(point);
    const SensorScan::Coordinates quanta = rounded(point, unit);
    if (isZero(quanta)) return leaveOut(&PointCounts::at_sensor);
    if (scan.soft && !addShares(scan.soft->begin(i), scan.soft->end(i), kept)) {
      return leaveOut(&PointCounts::not_finite);
    }
    kept.points.push_back(quanta);
    kept.labels.push_back(scan.labels[i]);
  };
  const bool as_they_are = to_sensor.isIdentity(0.0f) && !scan.soft && !scan.no_returns_at_max_range;
  std::array<SensorScan::Coordinates, kRun> run;
  for (std::size_t begin = 0; begin < scan.points.size(); begin += kRun) {
    const std::size_t end = std::min(begin + kRun, scan.points.size());
    if (as_they_are && roundRun({&scan.points[begin], end - begin}, unit, limit, run)) {
      kept.points.insert(kept.points.end(), run.begin(),
                         run.begin() + static_cast<std::ptrdiff_t>(end - begin));
      kept.labels.insert(kept.labels.end(), scan.labels.begin() + begin, scan.labels.begin() + end);
    } else {
      for (std::size_t i = begin; i < end; ++i) addPoint(i);
    }
  }
  for (const Eigen::Vector3f& direction : scan.no_returns) addDirection(to_sensor * direction);
  return result;
}

void place(const SensorScan& kept, const Eigen::Isometry3d& T_map_sensor, Scan& placed) {
  placed.origin = T_map_sensor.translation();
  const Eigen::Matrix3f rotation = roundedRotation(T_map_sensor);
  const auto unit = static_cast<float>(kept.quantum);
  placed.points.resize(kept.points.size());
  for (std::size_t i = 0; i < kept.points.size(); ++i) {
    placed.points[i].noalias() = rotation * vectorOf(kept.points[i], unit);
  }
  placed.labels = kept.labels;
  placed.labels_are_ids = kept.labels_are_ids;
  placed.soft.clear();
  std::size_t next = 0;
  for (const std::uint8_t count : kept.soft_counts) {
    placed.soft.startPoint();
    for (const std::size_t end = next + count; next < end; ++next) {
      placed.soft.add({kept.soft_ids[next], SensorScan::kShareUnit * kept.soft_shares[next]});
    }
  }
  placed.no_returns.clear();
  placed.no_returns.reserve(kept.no_returns.size());
  for (const SensorScan::Coordinates& direction : kept.no_returns) {
    placed.no_returns.push_back(rotation * vectorOf(direction, SensorScan::kDirectionUnit));
  }
  placed.no_returns_at_max_range = false;
  placed.sensor_model = kept.sensor_model;
  placed.stamp = kept.stamp;
}

Scan place(const SensorScan& kept, const Eigen::Isometry3d& T_map_sensor) {
  Scan scan;
  place(kept, T_map_sensor, scan);
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
