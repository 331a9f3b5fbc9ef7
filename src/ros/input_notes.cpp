#include "ros/input_notes.h"

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {

std::string InputNotes::ofSettings(const InputConfig& input, const ClassTable& classes) const {
  if (input.label_encoding != LabelEncoding::kNumber || !input.label_field.empty() || classes.size() <= 1) {
    return "";
  }
  return "Clouds of " + topic_ +
         " are taken without labels (label_field is empty), so all points get label 0 of class table '" +
         classes.name() + "'; set classes to occupancy";
}

InputSentences InputNotes::ofScan(const sensor_msgs::PointCloud2& cloud, const PlacedScan& placed,
                                  const PointCounts& counts, const ScanReader& reader,
                                  const ClassTable& classes, const MapperConfig& config) {
  InputSentences sentences;
  const auto add = [](std::vector<std::string>& list, const std::string& sentence) {
    if (!sentence.empty()) list.push_back(sentence);
  };
  add(sentences.warnings, ofLabels(placed, counts, reader.input(), classes, config));
  add(sentences.warnings, ofOrigin(reader.originDoubtful(cloud), reader.mapFrame()));
  add(sentences.warnings, ofFarPoints(counts.beyond_max, reader.input()));
  add(sentences.notes, ofTimes(placed.times));
  if (placed.no_direction) {
    const bool usual = *placed.no_direction == NoDirection::kFewReturns;
    add(usual ? sentences.notes : sentences.warnings,
        ofNoDirection(*placed.no_direction, counts.no_direction));
  }
  return sentences;
}

std::string InputNotes::ofOrigin(bool doubtful, const std::string& map_frame) {
  if (!doubtful || said_of_origin_) return "";
  said_of_origin_ = true;
  return "Clouds of " + topic_ + " are in the map frame '" + map_frame +
         "', so beams start at its origin; set sensor_frame_id to the sensor's frame";
}

std::string InputNotes::ofFarPoints(std::size_t count, const InputConfig& input) {
  if (count == 0 || input.sensor_model.knowsRange() || said_of_far_points_) return "";
  said_of_far_points_ = true;
  return std::to_string(count) + " points of a cloud of " + topic_ + " are farther than " +
         numberText(SensorModelConfig::kFarthest) +
         " m and left out as faults of the driver; set sensor_model/max_range to what the sensor sees";
}

std::string InputNotes::ofLabels(const PlacedScan& placed, const PointCounts& counts,
                                 const InputConfig& input, const ClassTable& classes,
                                 const MapperConfig& config) {
  const auto encoding = input.label_encoding == LabelEncoding::kRgb   ? LabelWatch::Encoding::kRgb
                        : input.label_encoding == LabelEncoding::kBgr ? LabelWatch::Encoding::kBgr
                                                                      : LabelWatch::Encoding::kNumber;
  Span<const std::uint32_t> labels = placed.scan.labels;
  if (placed.scan.labels_are_ids) labels = {};  // the reader's, not the cloud's
  const std::string said = labels_.report(classes, config.unknown_labels, counts, labels,
                                          placed.unlisted_labels, config.label_values, encoding);
  return said.empty() ? "" : "Clouds of " + topic_ + ": " + said;
}

std::string InputNotes::ofTimes(const std::string& reading) {
  if (reading.empty() || !times_.insert(reading).second) return "";
  return "Times of points of " + topic_ + " are read " + reading +
         "; set time_unit and time_reference if they are not";
}

std::string InputNotes::ofNoDirection(NoDirection reason, std::size_t count) {
  if (count == 0 || !no_directions_.insert(reason).second) return "";
  return std::to_string(count) + " beams without a return in a cloud of " + topic_ +
         " clear nothing: " + explain(reason);
}

}  // namespace bki_mapping::ros_interface
