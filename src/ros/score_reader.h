/// @file Labels that are not sure: scores of classes.
#pragma once

#include "ros/label_reader.h"

namespace bki_mapping::ros_shell {

/// For encodings scores and top_k. The shares of a point are its scores, made to add up to 1; its label is
/// the class with the largest share (ties: the smaller id). Scores that are not finite, or not positive
/// probabilities, and labels that are not in the class table do not count; a point left with none has no
/// label.
std::unique_ptr<LabelReader> makeScoreReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values);

}  // namespace bki_mapping::ros_shell
