#include "ros/point_field.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {
namespace {

using sensor_msgs::PointField;

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
T load(const std::uint8_t* bytes, bool swap) {
  std::uint8_t raw[sizeof(T)];
  std::memcpy(raw, bytes, sizeof(T));
  if (swap) std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

/// The names of the first fields of a cloud, for a message.
std::string namesOf(const sensor_msgs::PointCloud2& cloud) {
  constexpr std::size_t kMax = 20;
  std::string names;
  for (std::size_t f = 0; f < cloud.fields.size() && f < kMax; ++f) {
    names += (f == 0 ? "" : ", ") + shortText(cloud.fields[f].name, 40);
  }
  if (cloud.fields.size() > kMax) names += ", and " + std::to_string(cloud.fields.size() - kMax) + " more";
  return names.empty() ? "none" : names;
}

const PointField& find(const sensor_msgs::PointCloud2& cloud, const std::string& name) {
  const PointField* found = nullptr;
  for (const PointField& field : cloud.fields) {
    if (field.name != name) continue;
    if (found) throw std::invalid_argument("the cloud has two fields '" + name + "'");
    found = &field;
  }
  if (found) return *found;
  throw std::invalid_argument("the cloud has no field '" + name + "' (it has: " + namesOf(cloud) + ")");
}

}  // namespace

bool hostIsBigEndian() {
  const std::uint16_t one = 1;
  std::uint8_t first = 0;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

FieldReader::FieldReader(const sensor_msgs::PointCloud2& cloud, const std::string& name)
    : FieldReader(cloud, find(cloud, name), 0) {}

FieldReader::FieldReader(const sensor_msgs::PointCloud2& cloud, const PointField& field,
                         std::uint32_t component)
    : swap_((cloud.is_bigendian != 0) != hostIsBigEndian()) {
  const std::string& name = field.name;  // requested by the settings, so of reasonable length
  datatype_ = field.datatype;
  const std::size_t size = sizeOf(field.datatype);
  if (size == 0) {
    throw std::invalid_argument("field '" + name + "' of the cloud has the unknown datatype " +
                                std::to_string(field.datatype));
  }
  offset_ = std::size_t{field.offset} + component * size;
  if (offset_ + size > cloud.point_step) {
    throw std::invalid_argument("field '" + name + "' of the cloud ends at byte " +
                                std::to_string(offset_ + size) + ", beyond its point_step " +
                                std::to_string(cloud.point_step));
  }
}

double FieldReader::operator()(const std::uint8_t* point) const {
  const std::uint8_t* bytes = point + offset_;
  switch (datatype_) {
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
      return static_cast<double>(load<float>(bytes, swap_));
    default:
      return load<double>(bytes, swap_);
  }
}

std::optional<std::uint32_t> FieldReader::bits(const std::uint8_t* point) const {
  if (sizeOf(datatype_) == 4) return load<std::uint32_t>(point + offset_, swap_);
  const std::optional<std::int64_t> number = rounded(point);
  if (!number || *number < 0 || *number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(*number);
}

std::optional<std::int64_t> FieldReader::rounded(const std::uint8_t* point) const {
  const double value = std::round((*this)(point));
  if (!(std::abs(value) < 0x1p62)) return std::nullopt;
  return static_cast<std::int64_t>(value);
}

bool FieldReader::exact(std::int64_t number) const {
  return datatype_ != PointField::FLOAT32 || std::abs(number) <= 1 << 24;
}

bool FieldReader::integer() const {
  return datatype_ != PointField::FLOAT32 && datatype_ != PointField::FLOAT64;
}

std::uint32_t labelOf(std::int64_t number) {
  const bool fits = number >= std::numeric_limits<std::int32_t>::min() &&
                    number <= std::numeric_limits<std::uint32_t>::max();
  return fits ? static_cast<std::uint32_t>(number) : kNoLabel;
}

std::vector<FieldReader> readersOf(const sensor_msgs::PointCloud2& cloud, const std::string& list) {
  std::vector<FieldReader> readers;
  for (const std::string& name : splitList(list)) {
    const PointField& field = find(cloud, name);
    // One by one, without reserve(): a count beyond point_step is refused before memory is allocated for it.
    for (std::uint32_t c = 0; c < std::max(field.count, 1u); ++c) readers.emplace_back(cloud, field, c);
  }
  return readers;
}

std::vector<std::string> splitList(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream in(list);
  for (std::string part; std::getline(in, part, ',');) {
    const std::size_t first = part.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    parts.push_back(part.substr(first, part.find_last_not_of(' ') - first + 1));
  }
  return parts;
}

void checkSizes(const sensor_msgs::PointCloud2& cloud) {
  const std::uint64_t row = std::uint64_t{cloud.width} * cloud.point_step;
  if (row > cloud.row_step && cloud.height > 1) {
    throw std::invalid_argument("the cloud's row_step is smaller than width * point_step");
  }
  const std::uint64_t needed =
      cloud.height == 0 ? 0 : (std::uint64_t{cloud.height} - 1) * cloud.row_step + row;
  if (needed > cloud.data.size()) {
    throw std::invalid_argument("the cloud claims " + std::to_string(needed) +
                                " bytes of points, but holds " + std::to_string(cloud.data.size()));
  }
}

}  // namespace bki_mapping::ros_interface
