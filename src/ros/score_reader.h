/// @file Reads soft labels: a probability for each of several classes.
#pragma once

#include "ros/label_reader.h"

namespace bki_mapping::ros_interface {

/// Reader for the encodings scores and top_k. The soft label of a point is its scores, normalised to a sum of
/// 1; its label is the most probable class (ties: the smaller id). Skips probabilities that are not positive,
/// and labels that are not in the class table. A point has no label if none remains, or if a score is NaN or
/// +infinity.
std::unique_ptr<LabelReader> makeScoreReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values);

}  // namespace bki_mapping::ros_interface
