#include "bki_mapping/mapping/observation.h"

#include <algorithm>
#include <stdexcept>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {
namespace {

/// Points nearer than this are no hits: drivers put missing returns at the sensor [m].
constexpr float kSensorRadius = 1e-3f;

/// The class of a label, or none if hits with it are to be left out (and counted).
std::optional<ClassId> classOf(std::uint32_t label, const ClassTable& classes, const MapperConfig& config,
                               PointCounts& counts) {
  std::optional<ClassId> id;
  if (config.label_values == LabelValues::kRaw) {
    id = classes.classOfRaw(label);
  } else if (label < kMaxClasses && classes.find(static_cast<ClassId>(label))) {
    id = static_cast<ClassId>(label);
  }
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

Observation observe(const Scan& scan, const ClassTable& classes, const MapperConfig& config) {
  if (scan.labels.size() != scan.points.size()) {
    throw std::invalid_argument("the scan has " + std::to_string(scan.points.size()) + " points but " +
                                std::to_string(scan.labels.size()) + " labels; give one label a point");
  }
  const double cell = config.downsample_resolution;
  const GridGeometry geometry(cell > 0.0 ? std::min(cell, config.resolution) : config.resolution);
  const SensorModelConfig& sensor = config.sensor_model;
  const bool limited = sensor.max_range > 0.0;
  Observation seen;
  LabelledPoints hits, cut;
  hits.points.reserve(scan.points.size());
  hits.labels.reserve(scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3f& point = scan.points[i];
    const float range = point.norm();
    PointCounts& counts = seen.counts;
    ++counts.points;
    if (!point.allFinite()) {
      ++counts.not_finite;
    } else if (range < kSensorRadius) {
      ++counts.at_sensor;
    } else if (range < sensor.min_range) {
      ++counts.too_near;
    } else if (limited && range > sensor.max_range) {
      ++counts.beyond_max;
      if (config.clear_beyond_max_range) {
        cut.points.push_back(point * (static_cast<float>(sensor.max_range) / range));
      }
    } else if (!geometry.contains(scan.origin + point.cast<double>())) {
      ++counts.outside_map;
    } else if (const auto id = classOf(scan.labels[i], classes, config, counts)) {
      ++counts.used;
      hits.points.push_back(point);
      hits.labels.push_back(*id);
    }
  }
  cut.labels.assign(cut.points.size(), kFreeClass);
  seen.hits = downsample(scan.origin, hits, config.downsample_resolution);
  seen.beams.origin = scan.origin;
  appendBeams(seen.hits.points, seen.beams);
  appendBeams(downsample(scan.origin, cut, config.downsample_resolution).points, seen.beams);
  return seen;
}

}  // namespace bki_mapping
