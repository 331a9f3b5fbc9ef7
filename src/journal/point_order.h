/// @file An order in which the points of a scan follow each other closely.
#pragma once

#include <cstdint>
#include <vector>

#include "journal/next_point.h"
#include "journal/sensor_scan.h"

namespace bki_mapping {

/// An order of points, and what leads from one to the next.
struct PointOrder {
  /// The row of each point, numbered as they appear; empty: the points stay in the order in which they are.
  std::vector<std::uint8_t> rows;
  /// The points, row by row; empty without rows.
  std::vector<std::uint32_t> points;
  PointStep step;

  std::size_t at(std::size_t n) const { return points.empty() ? n : points[n]; }
};

/// The points of all rows, row by row, each row in the order in which its points are.
std::vector<std::uint32_t> rowByRow(const std::vector<std::uint8_t>& rows);

/// Chooses by a sample of the points. A lidar whose beams of a column follow each other has rows, which are
/// found by their elevations.
PointOrder chooseOrder(const ScanPoints& points);

}  // namespace bki_mapping
