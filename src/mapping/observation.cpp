#include "bki_mapping/mapping/observation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/inference/chunks.h"
#include "bki_mapping/mapping/soft_merge.h"

namespace bki_mapping {
namespace {

/// Points nearer than this are no hits: drivers put missing returns at the sensor [m].
constexpr float kSensorRadius = 1e-3f;

/// The class of a label, or none if hits with it are to be left out (and counted).
std::optional<ClassId> classOf(std::uint32_t label, LabelValues values, const ClassTable& classes,
                               const MapperConfig& config, PointCounts& counts) {
  std::optional<ClassId> id = classes.classOf(label, values);
  if (!id) {
    ++counts.labels_not_in_table;
    if (config.unknown_labels == UnknownLabels::kUnlabelled) id = classes.unlabelled();
    if (!id) {
      ++counts.unknown_label;
      return std::nullopt;
    }
  }
  if (config.unlabelled_points == UnlabelledPoints::kIgnore && id == classes.unlabelled()) {
    ++counts.unlabelled;
    return std::nullopt;
  }
  return id;
}

void appendBeams(const std::vector<Eigen::Vector3f>& ends, Beams& beams) {
  for (const Eigen::Vector3f& end : ends) {
    if (end.norm() >= kSensorRadius) beams.ends.push_back(end);
  }
}

}  // namespace

PointCounts& PointCounts::operator+=(const PointCounts& other) {
  for (const auto count : {&PointCounts::points, &PointCounts::used, &PointCounts::not_finite,
                           &PointCounts::at_sensor, &PointCounts::too_near, &PointCounts::beyond_max,
                           &PointCounts::outside_map, &PointCounts::unknown_label, &PointCounts::unlabelled,
                           &PointCounts::no_returns, &PointCounts::labels_not_in_table}) {
    this->*count += other.*count;
  }
  return *this;
}

void Observer::sortPoints(const Scan& scan, const ClassTable& classes, std::size_t chunk, std::size_t first,
                          std::size_t last, PointCounts& counts) {
  const double cell = config_.downsample_resolution;
  const GridGeometry geometry(cell > 0.0 ? std::min(cell, config_.resolution) : config_.resolution);
  const SensorModelConfig& sensor = scan.sensor_model ? *scan.sensor_model : config_.sensor_model;
  const LabelValues values = scan.labels_are_ids ? LabelValues::kId : config_.label_values;
  const bool limited = sensor.max_range > 0.0;
  const auto cut = [&](const Eigen::Vector3f& point, float range) {
    cut_.add(chunk, point * (static_cast<float>(sensor.max_range) / range), kFreeClass);
  };
  for (std::size_t i = first; i < last; ++i) {
    const Eigen::Vector3f& point = scan.points[i];
    const float range = point.norm();
    ++counts.points;
    if (!point.allFinite()) {
      ++counts.not_finite;
    } else if (range < kSensorRadius) {
      ++counts.at_sensor;
    } else if (range < sensor.min_range) {
      ++counts.too_near;
    } else if (limited && scan.no_returns_at_max_range &&
               std::abs(range - sensor.max_range) <= kAtMaxRange * sensor.max_range) {
      ++counts.no_returns;
      cut(point, range);
    } else if (limited && range > sensor.max_range) {
      ++counts.beyond_max;
      if (config_.clear_beyond_max_range) cut(point, range);
    } else if (!geometry.contains(scan.origin + point.cast<double>())) {
      ++counts.outside_map;
    } else if (const auto id = classOf(scan.labels[i], values, classes, config_, counts)) {
      ++counts.used;
      hits_.add(chunk, point, *id);
      if (!scan.soft.empty()) used_[chunk].push_back({static_cast<std::uint32_t>(i), *id});
    }
  }
}

void Observer::addNoReturns(const Scan& scan) {
  const SensorModelConfig& sensor = scan.sensor_model ? *scan.sensor_model : config_.sensor_model;
  for (const Eigen::Vector3f& direction : scan.no_returns) {
    const float length = direction.norm();
    ++seen_.counts.points;
    if (!direction.allFinite() || !(length > 0.0f) || !(sensor.max_range > 0.0)) {
      ++seen_.counts.not_finite;
      continue;
    }
    ++seen_.counts.no_returns;
    cut_.add(0, direction * (static_cast<float>(sensor.max_range) / length), kFreeClass);
  }
}

const Observation& Observer::observe(const Scan& scan, const ClassTable& classes, Workers& workers) {
  if (scan.labels.size() != scan.points.size()) {
    throw std::invalid_argument("the scan has " + std::to_string(scan.points.size()) + " points but " +
                                std::to_string(scan.labels.size()) + " labels; give one label a point");
  }
  if (!scan.soft.empty() && scan.soft.size() != scan.points.size()) {
    throw std::invalid_argument("the scan has soft labels, but not one set a point");
  }
  const Chunks chunks(scan.points.size());
  if (used_.size() < chunks.count()) used_.resize(chunks.count());
  for (auto& used : used_) used.clear();
  hits_.start(scan.origin, config_.downsample_resolution, chunks.count());
  cut_.start(scan.origin, config_.downsample_resolution, std::max<std::size_t>(chunks.count(), 1));
  counts_.assign(chunks.count(), {});
  workers.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    sortPoints(scan, classes, c, chunks.begin(c), chunks.end(c), counts_[c]);
  });
  seen_.counts = {};
  for (const PointCounts& counts : counts_) seen_.counts += counts;
  addNoReturns(scan);
  hits_.finish(workers, seen_.hits);
  seen_.soft.clear();
  if (!scan.soft.empty()) mergeSoftLabels(scan, used_, config_.downsample_resolution, seen_.hits, seen_.soft);
  cut_.finish(workers, cut_points_);
  seen_.beams.origin = scan.origin;
  seen_.beams.ends.clear();
  appendBeams(seen_.hits.points, seen_.beams);
  appendBeams(cut_points_.points, seen_.beams);
  return seen_;
}

}  // namespace bki_mapping
