#include "ros/point_account.h"

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <algorithm>
#include <cstdio>

#include "bki_mapping/core/named_parameter.h"
#include "core/counted.h"
#include "ros/point_field.h"

namespace bki_mapping::ros_interface {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// Fractions of points used, below which the level is WARN and ERROR.
constexpr double kFew = 0.1, kHardlyAny = 0.001;
/// Minimum fraction of points that are used or left out for a fault; fewer are no basis for an assessment.
constexpr double kSignificant = 0.01;
/// Fraction of points left out for their label from which the level is WARN.
constexpr double kManyUnknown = 0.1;

/// A clause about points of unknown labels, with the remedy.
std::string unknownLabels(const PointAccount& account, const InputConfig& input, const std::string& classes) {
  const auto& counts = account.unlisted_labels.counts();
  const auto most = std::max_element(counts.begin(), counts.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts.end() || most->second < account.unlisted_labels.missing()) {
    return "have no label (their field holds no number, no colour or no positive score); check label_field, "
           "label_encoding and score_fields";
  }
  const bool colors = hasColors(input.label_encoding);
  char color[16];
  std::snprintf(color, sizeof color, "0x%06x", static_cast<unsigned>(most->first));
  return std::string("have ") + (colors ? "colours" : "labels") + " that class table '" + classes +
         "' does not list (" + (colors ? color : std::to_string(most->first)) + " most often); " +
         account.label_remedy;
}

/// Names a limit, such as "sensor_model/min_range 2 m", or as the input's own.
std::string limit(const std::string& name, double value, double common) {
  return (value == common ? "sensor_model/" : "the input's ") + name + " " + numberText(value) + " m";
}

std::string sentenceOf(const PointKind& kind, const PointAccount& account, const InputConfig& input,
                       const MapperConfig& mapper, const std::string& classes) {
  const auto count = kind.in_scan;
  const SensorModelConfig& sensor = input.sensor_model;
  if (count == &PointCounts::unknown_label) return unknownLabels(account, input, classes);
  if (count == &PointCounts::not_finite) {
    return "are NaN or infinite; check the sensor, or set clear_no_returns if it sees open space";
  }
  if (count == &PointCounts::no_direction) {
    return "are beams without a return whose direction is not known; publish organised clouds of the whole "
           "sensor, and set sensor_frame_id to the frame where beams start";
  }
  if (count == &PointCounts::at_sensor) {
    return "are within 1 mm of the sensor, where drivers put beams without a return; check the sensor, or "
           "set clear_no_returns if it sees open space";
  }
  if (count == &PointCounts::too_near) {
    return "are nearer than " + limit("min_range", sensor.min_range, mapper.sensor_model.min_range) +
           "; lower it, or check that clouds are in metres";
  }
  if (count == &PointCounts::beyond_max && !sensor.knowsRange()) {
    return "are beyond " + numberText(sensor.reach()) +
           " m, which no sensor is taken to see unless sensor_model/max_range says so; check that clouds are "
           "in "
           "metres, or set it";
  }
  if (count == &PointCounts::beyond_max) {
    return "are beyond " + limit("max_range", sensor.max_range, mapper.sensor_model.max_range) +
           "; raise it, or check that clouds are in metres";
  }
  if (count == &PointCounts::unlabelled) {
    return "are of the unlabelled class; check the labels, or set unlabelled_points to occupied";
  }
  if (count == &PointCounts::airborne) {
    return "are of classes with the flag airborne; wait for better weather, or check the labels";
  }
  if (count == &PointCounts::isolated) {
    return "are hits near which few other beams end, as those of rain and snow; wait for better weather, or "
           "set rules/particles_within to 0 if the sensor is no lidar with rows";
  }
  return "are too far from the map's origin; check that clouds are in metres, and tf";
}

}  // namespace

const std::vector<PointKind>& pointKinds() {
  using C = PointCounts;
  using S = MappingStatus;
  static const std::vector<PointKind> kinds = {
      {"without a direction", &C::no_direction, &S::points_no_direction, true},
      {"NaN or infinite", &C::not_finite, &S::points_not_finite, true},
      {"at the sensor", &C::at_sensor, &S::points_at_sensor, true},
      {"nearer than min_range", &C::too_near, &S::points_too_near, false},
      {"beyond max_range", &C::beyond_max, &S::points_beyond_max, true},
      {"outside the map", &C::outside_map, &S::points_outside_map, false},
      {"unknown label", &C::unknown_label, &S::points_unknown_label, false},
      {"unlabelled", &C::unlabelled, &S::points_unlabelled, true},
      {"airborne", &C::airborne, &S::points_airborne, true},
      {"isolated", &C::isolated, &S::points_isolated, true},
  };
  return kinds;
}

void PointAccount::add(const PointCounts& of_scan, const UnlistedLabels& labels) {
  ++clouds;
  counts += of_scan;
  unlisted_labels += labels;
}

Health judgePoints(const PointAccount& account, const std::string& topic, const InputConfig& input,
                   const MapperConfig& mapper, const std::string& classes) {
  const PointCounts& counts = account.counts;
  const auto all = static_cast<double>(counts.points), used = static_cast<double>(counts.used);
  std::size_t faults = 0;
  const PointKind *worst = nullptr, *worst_fault = nullptr, *unknown = nullptr;
  const auto more = [&](const PointKind& kind, const PointKind* than) {
    return counts.*kind.in_scan > (than ? counts.*than->in_scan : 0);
  };
  for (const PointKind& kind : pointKinds()) {
    if (more(kind, worst)) worst = &kind;
    if (kind.in_scan == &PointCounts::unknown_label) unknown = &kind;
    if (kind.may_be_many) continue;
    faults += counts.*kind.in_scan;
    if (more(kind, worst_fault)) worst_fault = &kind;
  }
  const auto left_out = static_cast<double>(counts.unknown_label);
  const double sound = used + static_cast<double>(faults);
  Health health;
  if (worst_fault && sound >= kSignificant * all && used < kFew * sound) {
    health.level = used < kHardlyAny * sound ? DiagnosticStatus::ERROR : DiagnosticStatus::WARN;
    worst = worst_fault;
  } else if (worst && used + static_cast<double>(counts.no_returns) < kHardlyAny * all) {
    health.level = DiagnosticStatus::WARN;
  } else if (left_out > 0.0 && sound >= kSignificant * all && left_out >= kManyUnknown * (used + left_out)) {
    health.level = DiagnosticStatus::WARN;
    worst = unknown;
  } else {
    return health;
  }
  health.message = (used > 0.0 ? "only " + percentText(used / all) : std::string("none")) +
                   " of the points of the last " +
                   (account.clouds == 1 ? "cloud" : std::to_string(account.clouds) + " clouds") + " of " +
                   topic + " is used: " + percentText(static_cast<double>(counts.*worst->in_scan) / all) +
                   " " + sentenceOf(*worst, account, input, mapper, classes);
  return health;
}

}  // namespace bki_mapping::ros_interface
