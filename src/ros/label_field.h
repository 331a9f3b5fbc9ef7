/// @file Reads label numbers from a field of a cloud.
#pragma once

#include <cstdint>
#include <optional>

#include "bki_mapping/core/class_table.h"
#include "core/unlisted_labels.h"
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

}  // namespace bki_mapping::ros_interface
