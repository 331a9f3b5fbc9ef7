/// @file Clouds with any fields, for tests.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "ros/point_field.h"

namespace bki_mapping::ros_interface {

/// A cloud of one row with x, y, z and further fields, one after the other.
class CloudMaker {
 public:
  std::string frame = "sensor";
  double stamp = 100.0;

  explicit CloudMaker(const std::vector<Eigen::Vector3f>& points) : count_(points.size()) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (const auto& point : points) values.push_back(static_cast<double>(point[axis]));
      add(std::string(1, static_cast<char>('x' + axis)), sensor_msgs::PointField::FLOAT32, values);
    }
  }

  /// With coordinates in double precision.
  static CloudMaker inDoubles(const std::vector<Eigen::Vector3d>& points) {
    CloudMaker maker(points.size());
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (const auto& point : points) values.push_back(point[axis]);
      maker.add(std::string(1, static_cast<char>('x' + axis)), sensor_msgs::PointField::FLOAT64, values);
    }
    return maker;
  }

  CloudMaker& add(const std::string& name, std::uint8_t datatype, const std::vector<double>& values) {
    fields_.push_back({name, datatype, values});
    return *this;
  }

  sensor_msgs::PointCloud2 message() const {
    sensor_msgs::PointCloud2 cloud;
    cloud.header.frame_id = frame;
    cloud.header.stamp = ros::Time(stamp);
    cloud.height = 1;
    cloud.width = static_cast<std::uint32_t>(count_);
    cloud.is_bigendian = hostIsBigEndian();
    cloud.point_step = static_cast<std::uint32_t>(8 * fields_.size());
    cloud.row_step = cloud.point_step * cloud.width;
    cloud.data.resize(cloud.row_step);
    for (const Field& field : fields_) {
      sensor_msgs::PointField description;
      description.name = field.name;
      description.datatype = field.datatype;
      description.count = 1;
      description.offset = static_cast<std::uint32_t>(8 * cloud.fields.size());
      for (std::size_t i = 0; i < count_; ++i) {
        write(field.datatype, field.values[i], cloud.data.data() + i * cloud.point_step + description.offset);
      }
      cloud.fields.push_back(description);
    }
    return cloud;
  }

 private:
  explicit CloudMaker(std::size_t count) : count_(count) {}

  struct Field {
    std::string name;
    std::uint8_t datatype;
    std::vector<double> values;
  };

  /// Whole numbers take the nearest value that they can hold, and 0 for NaN.
  template <typename T>
  static void copy(double value, std::uint8_t* out) {
    if constexpr (std::is_integral_v<T>) {
      const double low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
      value = std::isnan(value) ? 0.0 : std::clamp(value, low, high);
    }
    const T typed = static_cast<T>(value);
    std::memcpy(out, &typed, sizeof(T));
  }
  static void write(std::uint8_t datatype, double value, std::uint8_t* out) {
    using sensor_msgs::PointField;
    if (datatype == PointField::INT8) copy<std::int8_t>(value, out);
    if (datatype == PointField::INT16) copy<std::int16_t>(value, out);
    if (datatype == PointField::INT32) copy<std::int32_t>(value, out);
    if (datatype == PointField::UINT8) copy<std::uint8_t>(value, out);
    if (datatype == PointField::UINT16) copy<std::uint16_t>(value, out);
    if (datatype == PointField::UINT32) copy<std::uint32_t>(value, out);
    if (datatype == PointField::FLOAT32) copy<float>(value, out);
    if (datatype == PointField::FLOAT64) copy<double>(value, out);
  }

  std::size_t count_;
  std::vector<Field> fields_;
};

}  // namespace bki_mapping::ros_interface
