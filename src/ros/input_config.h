/// @file Settings of one input of clouds.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/core/scan.h"

namespace bki_mapping::ros_interface {

/// How a cloud carries the class of a point.
enum class LabelEncoding {
  kNumber,  ///< a field with the label number
  kRgb,     ///< colours of the class table: one field 0x00RRGGBB, as PCL packs it, or three fields r,g,b
  kBgr,     ///< the same with red and blue exchanged
  kScores,  ///< one field, or one component of a field, for each class
  kTopK,    ///< fields, or components, with labels, and as many with their scores
};

inline bool hasColors(LabelEncoding encoding) {
  return encoding == LabelEncoding::kRgb || encoding == LabelEncoding::kBgr;
}

enum class ColorMatch { kExact, kNearest };
enum class ScoreType { kProbability, kLogit };

/// Unit of the times of points.
enum class TimeUnit { kAuto, kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

/// What the times of points count from.
enum class TimeReference {
  kAuto,
  kScan,        ///< the cloud's stamp; negative before it
  kScanEnd,     ///< any time; the last point has the cloud's stamp
  kUntilStamp,  ///< the point itself, up to the cloud's stamp
  kAbsolute,    ///< 1970, as stamps
};

/// Where clouds come from and what their fields mean.
struct InputConfig {
  std::string topic = "cloud_in";
  std::string label_field = "label";  ///< "": every point has label 0; kRgb: one or three; kTopK: k names
  LabelEncoding label_encoding = LabelEncoding::kNumber;
  ColorMatch color_match = ColorMatch::kExact;
  std::string score_fields;  ///< kScores: CLASS=FIELD pairs, or one field of many components; kTopK: k names
  ScoreType score_type = ScoreType::kProbability;
  std::string sensor_frame_id;  ///< frame at whose origin beams start; "": the cloud's
  std::string time_field;       ///< field with the time of each point; "": all have the cloud's stamp
  TimeUnit time_unit = TimeUnit::kAuto;
  TimeReference time_reference = TimeReference::kAuto;
  bool clear_no_returns = false;
  SensorModelConfig sensor_model;
};

/// What an input may set for itself, or all inputs have in common.
std::vector<NamedParameter<InputConfig>> inputParameters();
/// All parameters below `inputs/NAME/`: the above, `topic`, `min_range` and `max_range`.
std::vector<NamedParameter<InputConfig>> ownInputParameters();

}  // namespace bki_mapping::ros_interface
