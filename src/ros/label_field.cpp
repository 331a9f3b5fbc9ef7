#include "ros/label_field.h"

namespace bki_mapping::ros_interface {

LabelField::Label LabelField::read(const std::uint8_t* point, UnlistedLabels& unknown) {
  const std::optional<std::int64_t> number = field_.rounded(point);
  if (!any_read_ || number != number_) {
    any_read_ = true;
    number_ = number;
    label_.label = number && field_.exact(*number) ? labelOf(*number) : kNoLabel;
    label_.id = classes_.classOf(label_.label, values_);
  }
  if (label_.id) return label_;
  if (number) {
    unknown.add(*number);
    if (!field_.exact(*number)) unknown.noteRounding();
  } else {
    unknown.addMissing();
  }
  return label_;
}

}  // namespace bki_mapping::ros_interface
