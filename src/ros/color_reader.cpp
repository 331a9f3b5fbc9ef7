#include "ros/label_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <unordered_map>

#include "ros/point_field.h"

namespace bki_mapping::ros_interface {
namespace {

class ColorReader : public LabelReader {
 public:
  ColorReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input, const ClassTable& classes)
      : fields_(readersOf(cloud, input.label_field)),
        bgr_(input.label_encoding == LabelEncoding::kBgr),
        nearest_(input.color_match == ColorMatch::kNearest),
        classes_(classes) {
    if (fields_.size() != 1 && fields_.size() != 3) {
      throw std::invalid_argument("label_field '" + input.label_field + "' names " +
                                  std::to_string(fields_.size()) +
                                  " fields, but a colour is one packed field or three");
    }
  }

  void append(const std::uint8_t* point, CloudLabels& out) override {
    const std::uint32_t color = colorAt(point);
    const std::uint32_t label = classOf(color);
    if (color == kNoLabel) {
      out.unknown.addMissing();
    } else if (label == kNoLabel) {
      out.unknown.add(color);
    }
    out.are_ids = true;
    out.labels.push_back(label);
  }

 private:
  /// 0xRRGGBB, or kNoLabel if the values are not a colour.
  std::uint32_t colorAt(const std::uint8_t* point) const {
    std::uint32_t color = 0;
    if (fields_.size() == 1) {
      const auto packed = fields_[0].bits(point);
      if (!packed) return kNoLabel;
      color = *packed & 0xffffffu;  // the highest byte may hold an alpha
    } else {
      for (const FieldReader& field : fields_) {
        const double part = std::round(field(point));
        if (!(part >= 0.0 && part <= 255.0)) return kNoLabel;
        color = color << 8 | static_cast<std::uint32_t>(part);
      }
    }
    return bgr_ ? (color & 0xffu) << 16 | (color & 0xff00u) | color >> 16 : color;
  }

  std::uint32_t classOf(std::uint32_t color) {
    if (color == kNoLabel) return kNoLabel;
    const auto known = class_of_.find(color);
    if (known != class_of_.end()) return known->second;
    std::uint32_t best = kNoLabel, least = std::numeric_limits<std::uint32_t>::max();
    for (const SemanticClass& c : classes_.classes()) {
      const std::uint32_t distance = distance2(color, c);
      if (distance < least || (distance == least && c.id < best)) {
        least = distance;
        best = c.id;
      }
    }
    if (!nearest_ && least > 0) best = kNoLabel;
    // Bounds memory: a camera image can have millions of colours, few of which repeat.
    if (class_of_.size() < 65536) class_of_[color] = best;
    return best;
  }

  static std::uint32_t distance2(std::uint32_t color, const SemanticClass& c) {
    std::uint32_t sum = 0;
    for (int part = 0; part < 3; ++part) {
      const int d =
          static_cast<int>(color >> (16 - 8 * part) & 0xffu) - c.color[static_cast<std::size_t>(part)];
      sum += static_cast<std::uint32_t>(d * d);
    }
    return sum;
  }

  std::vector<FieldReader> fields_;
  bool bgr_, nearest_;
  const ClassTable& classes_;
  std::unordered_map<std::uint32_t, std::uint32_t> class_of_;
};

}  // namespace

std::unique_ptr<LabelReader> makeColorReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes) {
  return std::make_unique<ColorReader>(cloud, input, classes);
}

}  // namespace bki_mapping::ros_interface
