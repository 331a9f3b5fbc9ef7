#include "bki_mapping/ros/cloud_conversion.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace bki_mapping::ros_shell {
namespace {

using sensor_msgs::PointField;

constexpr std::uint32_t kNoLabel = 0xffffffffu;

bool hostIsBigEndian() {
  const std::uint16_t one = 1;
  std::uint8_t first = 0;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

std::size_t sizeOf(std::uint8_t datatype) {
  switch (datatype) {
    case PointField::INT8:
    case PointField::UINT8:
      return 1;
    case PointField::INT16:
    case PointField::UINT16:
      return 2;
    case PointField::INT32:
    case PointField::UINT32:
    case PointField::FLOAT32:
      return 4;
    case PointField::FLOAT64:
      return 8;
    default:
      return 0;
  }
}

template <typename T>
double load(const std::uint8_t* bytes, bool swap) {
  std::uint8_t raw[sizeof(T)];
  std::memcpy(raw, bytes, sizeof(T));
  if (swap) std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return static_cast<double>(value);
}

/// Reads one field of any datatype.
class FieldReader {
 public:
  FieldReader(const sensor_msgs::PointCloud2& cloud, const std::string& name)
      : field_(find(cloud, name)), swap_((cloud.is_bigendian != 0) != hostIsBigEndian()) {
    const std::size_t size = sizeOf(field_.datatype);
    if (size == 0) {
      throw std::invalid_argument("field '" + name + "' of the cloud has the unknown datatype " +
                                  std::to_string(field_.datatype));
    }
    if (std::size_t{field_.offset} + size > cloud.point_step) {
      throw std::invalid_argument("field '" + name + "' of the cloud ends at byte " +
                                  std::to_string(std::size_t{field_.offset} + size) +
                                  ", beyond its point_step " + std::to_string(cloud.point_step));
    }
  }

  double operator()(const std::uint8_t* point) const {
    const std::uint8_t* bytes = point + field_.offset;
    switch (field_.datatype) {
      case PointField::INT8:
        return load<std::int8_t>(bytes, swap_);
      case PointField::UINT8:
        return load<std::uint8_t>(bytes, swap_);
      case PointField::INT16:
        return load<std::int16_t>(bytes, swap_);
      case PointField::UINT16:
        return load<std::uint16_t>(bytes, swap_);
      case PointField::INT32:
        return load<std::int32_t>(bytes, swap_);
      case PointField::UINT32:
        return load<std::uint32_t>(bytes, swap_);
      case PointField::FLOAT32:
        return load<float>(bytes, swap_);
      default:
        return load<double>(bytes, swap_);
    }
  }

 private:
  static PointField find(const sensor_msgs::PointCloud2& cloud, const std::string& name) {
    std::string names;
    for (const PointField& field : cloud.fields) {
      if (field.name == name) return field;
      names += (names.empty() ? "" : ", ") + field.name;
    }
    throw std::invalid_argument("the cloud has no field '" + name + "' (it has: " + names + ")");
  }

  PointField field_;
  bool swap_;
};

void checkSizes(const sensor_msgs::PointCloud2& cloud) {
  const std::uint64_t row = std::uint64_t{cloud.width} * cloud.point_step;
  if (row > cloud.row_step && cloud.height > 1) {
    throw std::invalid_argument("the cloud's row_step is smaller than width * point_step");
  }
  const std::uint64_t needed =
      cloud.height == 0 ? 0 : (std::uint64_t{cloud.height} - 1) * cloud.row_step + row;
  if (needed > cloud.data.size()) {
    throw std::invalid_argument("the cloud says it has " + std::to_string(needed) +
                                " bytes of points, but holds " + std::to_string(cloud.data.size()));
  }
}

std::uint32_t labelOf(double value) {
  const double rounded = std::round(value);
  return rounded >= 0.0 && rounded < kNoLabel ? static_cast<std::uint32_t>(rounded) : kNoLabel;
}

}  // namespace

CloudContent readCloud(const sensor_msgs::PointCloud2& cloud, const std::string& label_field) {
  checkSizes(cloud);
  const FieldReader x(cloud, "x"), y(cloud, "y"), z(cloud, "z");
  const FieldReader label(cloud, label_field.empty() ? "x" : label_field);
  CloudContent content;
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  content.points.reserve(count);
  content.labels.reserve(count);
  for (std::size_t row = 0; row < cloud.height; ++row) {
    for (std::size_t column = 0; column < cloud.width; ++column) {
      const std::uint8_t* point = cloud.data.data() + row * cloud.row_step + column * cloud.point_step;
      content.points.emplace_back(static_cast<float>(x(point)), static_cast<float>(y(point)),
                                  static_cast<float>(z(point)));
      content.labels.push_back(label_field.empty() ? 0 : labelOf(label(point)));
    }
  }
  return content;
}

sensor_msgs::PointCloud2 makeCloud(const std::vector<Eigen::Vector3f>& points,
                                   const std::vector<float>& intensities,
                                   const std::vector<std::uint32_t>& labels) {
  sensor_msgs::PointCloud2 cloud;
  const char* names[] = {"x", "y", "z", "intensity", "label"};
  for (std::uint32_t f = 0; f < 5; ++f) {
    PointField field;
    field.name = names[f];
    field.offset = 4 * f;
    field.datatype = f < 4 ? PointField::FLOAT32 : PointField::UINT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.point_step = 20;
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.is_bigendian = hostIsBigEndian();
  cloud.is_dense = false;
  cloud.data.resize(std::size_t{cloud.row_step});
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint8_t* out = cloud.data.data() + 20 * i;
    std::memcpy(out, points[i].data(), 12);
    std::memcpy(out + 12, &intensities[i], 4);
    std::memcpy(out + 16, &labels[i], 4);
  }
  return cloud;
}

}  // namespace bki_mapping::ros_shell
