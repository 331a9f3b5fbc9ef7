/// @file Labels of points in every encoding.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <map>
#include <memory>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/soft_labels.h"
#include "ros/input_config.h"
#include "ros/point_field.h"

namespace bki_mapping::ros_shell {

/// The labels of a cloud's points.
struct CloudLabels {
  std::vector<std::uint32_t> labels;  ///< one a point; kNoLabel where there is none
  bool are_ids = false;               ///< ids of the class table, or as `label_values` says
  SoftLabels soft;                    ///< of encodings scores and top_k; else empty
  /// What was found instead of a class, and how often; at most kMostUnknown values are told apart.
  std::map<std::uint32_t, std::size_t> unknown;

  static constexpr std::size_t kMostUnknown = 64;
  void countUnknown(std::uint32_t value) {
    if (unknown.size() < kMostUnknown || unknown.count(value) > 0) ++unknown[value];
  }
};

/// Reads labels point by point.
class LabelReader {
 public:
  virtual ~LabelReader() = default;
  /// Appends the label of a point. @param point its first byte.
  virtual void append(const std::uint8_t* point, CloudLabels& out) = 0;
};

/// A reader for the input's encoding. The cloud's sizes must have been checked.
/// @param classes must live as long as the reader.
/// @throws std::invalid_argument in one sentence: fields are missing, or do not fit the encoding or the
/// table.
std::unique_ptr<LabelReader> makeLabelReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values);

}  // namespace bki_mapping::ros_shell
