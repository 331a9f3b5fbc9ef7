#include <algorithm>
#include <cmath>

#include "beams/beam_index.h"
#include "parallel/group_by.h"

namespace bki_mapping {

void BeamTable::build(const std::vector<std::uint32_t>& cells, std::vector<std::uint32_t>& order) {
  constexpr std::size_t kCells = kBeamRows * kBeamColumns;
  begin_.assign(kCells + 1, 0);
  for (const std::uint32_t cell : cells) ++begin_[cell + 1];
  order.resize(cells.size());
  groupBy(kCells, begin_.data(), [&](auto&& positionOf) {
    for (std::uint32_t b = 0; b < cells.size(); ++b) order[positionOf(cells[b])] = b;
  });
}

void BeamTable::appendCells(int row, int first, int last, std::vector<BeamRange>& ranges) const {
  const std::size_t base = static_cast<std::size_t>(row) * kBeamColumns;
  const BeamRange range{begin_[base + static_cast<std::size_t>(first)],
                        begin_[base + static_cast<std::size_t>(last) + 1]};
  if (range.first < range.last) ranges.push_back(range);
}

void BeamTable::query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const {
  ranges.clear();
  if (begin_.empty()) return;
  const Eigen::Vector3d c = centre.cast<double>();
  const double l = radius * (1.0 + 1e-5) + 1e-5 * c.norm();  // margin for the rounding of directions
  const double r = c.norm(), rho = c.head<2>().norm();
  if (r <= l) {
    if (begin_.back() > 0) ranges.push_back({0, begin_.back()});
    return;
  }
  // Equations (8) and (9) of docs/method.md: the ball subtends asin(l / r) in elevation and asin(l / rho) in
  // azimuth, or every azimuth where it covers a pole.
  const double cos_delta = std::sqrt(1.0 - l * l / (r * r));
  const double a = c.z() / r * cos_delta, b = rho / r * (l / r);
  const bool pole = rho <= l;
  const int first_row = beamRow(static_cast<float>(pole && c.z() < 0.0 ? -1.0 : a - b));
  const int last_row = beamRow(static_cast<float>(pole && c.z() > 0.0 ? 1.0 : a + b));
  int first = 0, last = kBeamColumns - 1;
  if (!pole) {
    const double s = l / rho, k = std::sqrt(1.0 - s * s);
    const auto column = [](double x, double y) {
      return beamColumn(pseudoAngle(static_cast<float>(x), static_cast<float>(y)));
    };
    first = column(c.x() * k + c.y() * s, c.y() * k - c.x() * s);
    last = column(c.x() * k - c.y() * s, c.y() * k + c.x() * s);
  }
  for (int row = first_row; row <= last_row; ++row) {
    if (first <= last) {
      appendCells(row, first, last, ranges);
    } else {  // across the seam
      appendCells(row, first, kBeamColumns - 1, ranges);
      appendCells(row, 0, last, ranges);
    }
  }
}

}  // namespace bki_mapping
