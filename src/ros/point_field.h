/// @file Reads fields of sensor_msgs/PointCloud2, of any datatype, offset and byte order.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"

namespace bki_mapping::ros_interface {

bool hostIsBigEndian();

/// Reads one component of one field. @pre checkSizes(cloud) has passed.
class FieldReader {
 public:
  /// @throws std::invalid_argument in one sentence: the field is missing, occurs twice, has an unknown
  /// datatype, or extends beyond point_step.
  FieldReader(const sensor_msgs::PointCloud2& cloud, const std::string& name);
  /// @param component index of the component, below field.count.
  FieldReader(const sensor_msgs::PointCloud2& cloud, const sensor_msgs::PointField& field,
              std::uint32_t component);

  /// The value. @param point first byte of a point.
  double operator()(const std::uint8_t* point) const;
  /// The bits of a FLOAT32, INT32 or UINT32; for other datatypes the rounded value, or nullopt if that does
  /// not fit into 32 bits.
  std::optional<std::uint32_t> bits(const std::uint8_t* point) const;
  /// The value rounded to an integer; nullopt if it is not finite, or its magnitude is 2^62 or more.
  std::optional<std::int64_t> rounded(const std::uint8_t* point) const;
  bool integer() const;  ///< whether the datatype is an integer
  /// Whether the datatype holds this integer and all that are smaller: FLOAT32 does so up to 2^24.
  bool exact(std::int64_t number) const;
  bool single() const { return datatype_ == sensor_msgs::PointField::FLOAT32; }

 private:
  std::uint8_t datatype_;
  std::size_t offset_;
  bool swap_;
};

/// A number as a label: of a negative one, the bits of a signed integer. kNoLabel if it has more than 32
/// bits.
std::uint32_t labelOf(std::int64_t number);

/// Readers of all components of all fields in a list such as "a,b".
std::vector<FieldReader> readersOf(const sensor_msgs::PointCloud2& cloud, const std::string& list);

/// The items of a list such as "a, b", without spaces.
std::vector<std::string> splitList(const std::string& list);

/// Checks that all points are within the data. @throws std::invalid_argument otherwise.
void checkSizes(const sensor_msgs::PointCloud2& cloud);

}  // namespace bki_mapping::ros_interface
