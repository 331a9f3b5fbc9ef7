#include "ros/input_config.h"

namespace bki_mapping::ros_shell {

std::vector<NamedParameter<InputConfig>> inputParameters() {
  using C = InputConfig;
  return {
      textParameter<C>(
          "label_field", "names of fields, separated by commas, or empty",
          "Field of clouds with the label (encoding number), the packed colour or three fields with its "
          "parts "
          "(rgb, bgr), or labels from the likeliest on (top_k); with an empty name every point has the label "
          "0.",
          [](C & c) -> auto& { return c.label_field; }),
      choiceParameter<C>(
          "label_encoding", {"number", "rgb", "bgr", "scores", "top_k"},
          "How clouds tell the class of a point: a label number, a colour of the class table (packed as "
          "0xRRGGBB or 0xBBGGRR), a score for each class, or the k likeliest labels with their scores.",
          [](C & c) -> auto& { return c.label_encoding; }),
      choiceParameter<C>(
          "color_match", {"exact", "nearest"},
          "Encodings rgb and bgr: whether a colour must be one of the class table, or means the nearest one.",
          [](C & c) -> auto& { return c.color_match; }),
      textParameter<C>(
          "score_fields", "CLASS=FIELD or names of fields, separated by commas, or empty",
          "Encoding scores: the field of each class as CLASS=FIELD, or one field with a component for each "
          "class "
          "in the table's order; encoding top_k: fields with the scores of label_field.",
          [](C & c) -> auto& { return c.score_fields; }),
      choiceParameter<C>(
          "score_type", {"probability", "logit"},
          "Whether scores are in proportion to probabilities, or their logarithms.",
          [](C & c) -> auto& { return c.score_type; }),
      textParameter<C>(
          "sensor_frame_id", "a frame of tf, or empty",
          "The frame at whose origin beams start; empty: the cloud's own frame.",
          [](C & c) -> auto& { return c.sensor_frame_id; }),
      textParameter<C>(
          "time_field", "the name of a field, or empty",
          "Field with each point's time, in s after the cloud's stamp (floating point) or ns after it "
          "(integer); "
          "points are then put where tf saw the sensor at that time.",
          [](C & c) -> auto& { return c.time_field; }),
      choiceParameter<C>(
          "clear_no_returns", {"false", "true"},
          "Whether beams without a return clear the space up to sensor_model/max_range: points with one "
          "infinite "
          "coordinate or more, points at max_range itself, and, in organised clouds, points that are NaN.",
          [](C & c) -> auto& { return c.clear_no_returns; }),
  };
}

std::vector<NamedParameter<InputConfig>> ownInputParameters() {
  using C = InputConfig;
  auto parameters = inputParameters();
  parameters.push_back(textParameter<C>(
      "topic", "a topic", "Where the clouds come from.", [](C & c) -> auto& { return c.topic; }));
  parameters.push_back(realParameter<C>(
      "min_range", "a number >= 0", "m", "As sensor_model/min_range.",
      [](C & c) -> auto& { return c.sensor_model.min_range; }, [](double x) { return x >= 0.0; }));
  parameters.push_back(realParameter<C>(
      "max_range", "a number > 0, or -1 for no limit", "m", "As sensor_model/max_range.",
      [](C & c) -> auto& { return c.sensor_model.max_range; },
      [](double x) { return x > 0.0 || x == -1.0; }));
  return parameters;
}

}  // namespace bki_mapping::ros_shell
