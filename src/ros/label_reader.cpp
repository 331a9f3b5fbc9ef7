#include "ros/label_reader.h"

namespace bki_mapping::ros_interface {
namespace {

/// Gives every point the label 0.
class NoLabels : public LabelReader {
 public:
  void append(const std::uint8_t*, CloudLabels& out) override { out.labels.push_back(0); }
};

/// Reads the label from a field of any datatype.
class NumberReader : public LabelReader {
 public:
  NumberReader(const sensor_msgs::PointCloud2& cloud, const std::string& field, const ClassTable& classes,
               LabelValues values)
      : field_(FieldReader(cloud, field), classes, values) {}

  void append(const std::uint8_t* point, CloudLabels& out) override {
    out.labels.push_back(field_.read(point, out.unknown).label);
  }

 private:
  LabelField field_;
};

}  // namespace

std::unique_ptr<LabelReader> makeLabelReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values) {
  switch (input.label_encoding) {
    case LabelEncoding::kRgb:
    case LabelEncoding::kBgr:
      return makeColorReader(cloud, input, classes);
    case LabelEncoding::kScores:
    case LabelEncoding::kTopK:
      return makeScoreReader(cloud, input, classes, label_values);
    default:
      if (input.label_field.empty()) return std::make_unique<NoLabels>();
      return std::make_unique<NumberReader>(cloud, input.label_field, classes, label_values);
  }
}

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
