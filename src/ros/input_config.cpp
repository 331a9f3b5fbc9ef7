#include "ros/input_config.h"

#include "core/frame_name.h"
#include "core/sensor_model_parameters.h"

namespace bki_mapping::ros_interface {

std::vector<NamedParameter<InputConfig>> inputParameters() {
  using C = InputConfig;
  return {
      textParameter(
          "label_field", &C::label_field, "names of fields, separated by commas, or empty", Changes::kAtStart,
          "Field with the labels: the label number (encoding number), the packed colour or three "
          "fields with its parts (rgb, bgr), or k labels from the likeliest on (top_k). Set it empty "
          "for clouds without labels; every point then has the label 0."),
      choiceParameter("label_encoding", &C::label_encoding, {"number", "rgb", "bgr", "scores", "top_k"},
                      Changes::kAtStart,
                      "How a point carries its class: a label number, a colour of the class table (packed as "
                      "0xRRGGBB or 0xBBGGRR), a score for each class, or the k likeliest labels with their "
                      "scores."),
      choiceParameter(
          "color_match", &C::color_match, {"exact", "nearest"}, Changes::kAtStart,
          "How encodings rgb and bgr find the class of a colour: exact requires a colour of the "
          "class table, nearest takes the most similar one. Use nearest if images were compressed "
          "or resized."),
      textParameter(
          "score_fields", &C::score_fields, "CLASS=FIELD or names of fields, separated by commas, or empty",
          Changes::kAtStart,
          "Fields with the scores. Encoding scores: CLASS=FIELD for each class, or one field with a "
          "component for each class in the order of the class table. Encoding top_k: a field for "
          "each of label_field."),
      choiceParameter("score_type", &C::score_type, {"probability", "logit"}, Changes::kAtStart,
                      "What scores are: probability for numbers in proportion to probabilities, logit for "
                      "their logarithms, as a network has them before its softmax."),
      frameParameter(
          "sensor_frame_id", &C::sensor_frame_id, "a frame of tf, or empty", Changes::kAtStart,
          "Frame at whose origin beams start. Set it for clouds that are in the map frame already, or "
          "merged from several sensors; empty takes the cloud's own frame."),
      textParameter(
          "time_field", &C::time_field, "the name of a field, or empty", Changes::kAtStart,
          "Field with the time of each point. Set it to correct for the sensor's motion during a scan; "
          "empty takes all points at the stamp."),
      choiceParameter(
          "time_unit", &C::time_unit, {"auto", "s", "ms", "us", "ns"}, Changes::kAtStart,
          "Unit of time_field. auto takes s for floating-point numbers and ns for integers, unless a "
          "scan of 0.02 to 1 s proves another one; clouds that leave a doubt are dropped."),
      choiceParameter(
          "time_reference", &C::time_reference, {"auto", "scan", "scan_end", "until_stamp", "absolute"},
          Changes::kAtStart,
          "What the times of time_field count from: the cloud's stamp (scan; times before it are "
          "negative), any start of a scan whose last point has the stamp (scan_end), the point itself, "
          "up to the stamp (until_stamp), or 1970 (absolute). auto takes absolute if the times are near "
          "the stamp, else scan."),
      truthParameter(
          "clear_no_returns", &C::clear_no_returns, Changes::kAtStart,
          "Clear space up to sensor_model/max_range along beams without a return. These are points "
          "with exactly one infinite coordinate, points at max_range itself and, in organised clouds of "
          "spinning lidars, points that are NaN, infinite or 0, 0, 0, where the returns around them tell "
          "their direction. Set true to map open space."),
  };
}

std::vector<NamedParameter<InputConfig>> ownInputParameters() {
  using C = InputConfig;
  auto parameters = inputParameters();
  parameters.push_back(textParameter("topic", &C::topic, "a topic", Changes::kAtStart,
                                     "Topic of the clouds; the name of the input where it is not set."));
  appendParameters(parameters, "", &C::sensor_model, sensorModelParameters());
  return parameters;
}

}  // namespace bki_mapping::ros_interface
