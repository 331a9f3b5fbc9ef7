/// @file Reads the labels of points, in every encoding.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "core/unlisted_labels.h"
#include "ros/input_config.h"
#include "ros/point_field.h"

namespace bki_mapping::ros_interface {

/// Reads the labels of a field of any datatype, and their classes. A number that the datatype may have
/// rounded is no label: it may be that of another class.
class LabelField {
 public:
  /// @param classes must outlive the object.
  LabelField(const FieldReader& field, const ClassTable& classes, LabelValues values)
      : field_(field), classes_(classes), values_(values) {}

  struct Label {
    std::uint32_t label = kNoLabel;  ///< as the mapper takes it
    std::optional<ClassId> id;       ///< no value if the class table has none for it
  };
  /// The label of a point. @param[in,out] unknown it is counted there if the class table has none for it.
  Label read(const std::uint8_t* point, UnlistedLabels& unknown);

 private:
  FieldReader field_;
  const ClassTable& classes_;
  LabelValues values_;
  // Of the last point, since neighbouring points mostly have the same label:
  bool any_read_ = false;
  std::optional<std::int64_t> number_;
  Label label_;
};

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

/// Reader for the encodings rgb and bgr. A colour of several classes means the one with the smallest id.
std::unique_ptr<LabelReader> makeColorReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes);

/// Reader for the encodings scores and top_k. The soft label of a point is its scores, normalised to a sum of
/// 1; its label is the most probable class (ties: the smaller id). Skips probabilities that are not positive,
/// and labels that are not in the class table. A point has no label if none remains, or if a score is NaN or
/// +infinity.
std::unique_ptr<LabelReader> makeScoreReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values);

}  // namespace bki_mapping::ros_interface
