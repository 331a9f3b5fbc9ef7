/// @file A list of points of a packed scan.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <vector>

#include "journal/byte_planes.h"
#include "journal/next_point.h"
#include "journal/point_order.h"

namespace bki_mapping {

/// How a list of points is stored.
struct ListHeader {
  std::int32_t cosine, sine;
  std::uint8_t along_ray, by_rows;
  std::uint8_t bytes[3];  ///< of a number in PointErrors::first, second and third
  std::uint8_t label_bytes;
  std::uint16_t unused;

  bool isValid() const {
    const auto is_flag = [](std::uint8_t flag) { return flag <= 1; };
    return step().isValid() && is_flag(along_ray) && is_flag(by_rows) && label_bytes <= 4 &&
           std::all_of(std::begin(bytes), std::end(bytes), [](std::uint8_t count) { return count <= 4; });
  }
  PointStep step() const { return {cosine, sine, along_ray != 0}; }
  /// Of each point and its label.
  std::uint64_t bytesOfPoint() const { return by_rows + bytes[0] + 1u + bytes[1] + bytes[2] + label_bytes; }
};
static_assert(sizeof(ListHeader) == 16);

/// Where points are beside where they are guessed, in the order in which they are stored.
struct PointErrors {
  std::vector<std::uint32_t> first;
  /// The lower four bits of the second coordinate, and above them those of the third: both are mostly below
  /// 4, where one code for two numbers is shorter than two codes.
  std::vector<std::uint8_t> low;
  std::vector<std::uint32_t> second, third;  ///< without the lower four bits
};

/// A list of points, and what follows from it for its planes.
class PointList {
 public:
  /// @param labels of the points, or none. All must outlive this.
  PointList(const ScanPoints& points, const std::vector<std::uint32_t>& labels);

  const ListHeader& header() const { return header_; }
  void write(PlaneWriter& planes) const;

 private:
  const std::vector<std::uint32_t>& labels_;
  PointOrder order_;
  PointErrors errors_;
  ListHeader header_ = {};
};

/// Reads a list of points and, unless there are none, their labels.
/// @param header a valid one. @param planes must have as many bytes as the header says.
void readList(const ListHeader& header, std::size_t count, PlaneReader& planes, ScanPoints& points,
              std::vector<std::uint32_t>* labels);

}  // namespace bki_mapping
