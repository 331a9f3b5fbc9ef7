/// @file Fields of sensor_msgs/PointCloud2, of any datatype, offset and byte order.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bki_mapping::ros_shell {

/// Stands for a label that is no number, no colour of the table, or no class at all.
constexpr std::uint32_t kNoLabel = 0xffffffffu;

bool hostIsBigEndian();

/// Reads one component of one field. The cloud's sizes must have been checked.
class FieldReader {
 public:
  /// @throws std::invalid_argument in one sentence: the field is missing, there twice, of an unknown
  /// datatype, or beyond point_step.
  FieldReader(const sensor_msgs::PointCloud2& cloud, const std::string& name);
  /// @param field of the cloud. @param component of it, if its count is above 1.
  FieldReader(const sensor_msgs::PointCloud2& cloud, const sensor_msgs::PointField& field,
              std::uint32_t component);

  /// The value. @param point first byte of a point.
  double operator()(const std::uint8_t* point) const;
  /// The 32 bits of a FLOAT32, INT32 or UINT32 as they are; the rounded value of other datatypes, or none if
  /// that is no number of 32 bits.
  std::optional<std::uint32_t> bits(const std::uint8_t* point) const;
  /// The label number that the value names, rounded; kNoLabel if it names none.
  std::uint32_t label(const std::uint8_t* point) const;
  bool integer() const;  ///< whether the datatype is a whole number

 private:
  std::uint8_t datatype_;
  std::size_t offset_;
  bool swap_;
};

/// Readers of all components of all fields of a list like "a,b".
std::vector<FieldReader> readersOf(const sensor_msgs::PointCloud2& cloud, const std::string& list);

/// The parts of a list like "a, b", without blanks.
std::vector<std::string> splitList(const std::string& list);

/// @throws std::invalid_argument if rows or points do not fit into the data.
void checkSizes(const sensor_msgs::PointCloud2& cloud);

}  // namespace bki_mapping::ros_shell
