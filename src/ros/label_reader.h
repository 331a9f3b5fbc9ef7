/// @file Reads the labels of points, in every encoding.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <memory>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "core/unlisted_labels.h"
#include "ros/input_config.h"
#include "ros/point_field.h"

namespace bki_mapping::ros_interface {

/// The labels of a cloud's points.
struct CloudLabels {
  std::vector<std::uint32_t> labels;  ///< one per point; kNoLabel for points without a label
  bool are_ids = false;               ///< whether they are class ids; otherwise `label_values` decides
  SoftLabels soft;                    ///< for the encodings scores and top_k; otherwise empty
  UnlistedLabels unknown;             ///< those that are not in the class table
};

/// Reads the label of one point at a time.
class LabelReader {
 public:
  virtual ~LabelReader() = default;
  /// Appends the label of a point. @param point its first byte in the cloud.
  virtual void append(const std::uint8_t* point, CloudLabels& out) = 0;
};

/// A reader for the input's encoding. @pre checkSizes(cloud) has passed.
/// @param classes must outlive the reader.
/// @throws std::invalid_argument in one sentence: fields are missing, or do not match the encoding or the
/// class table.
std::unique_ptr<LabelReader> makeLabelReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values);

}  // namespace bki_mapping::ros_interface
