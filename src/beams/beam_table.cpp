#include <algorithm>
#include <cmath>

#include "beams/beam_index.h"
#include "parallel/group_by.h"

namespace bki_mapping {
namespace {

/// Margin for the rounding of directions, as a part of lengths.
constexpr double kRounding = 1e-5;

int columnOf(const Eigen::Vector2d& v) {
  return beamColumn(pseudoAngle(static_cast<float>(v.x()), static_cast<float>(v.y())));
}

}  // namespace

void BeamTable::build(const std::vector<std::uint32_t>& cells, std::vector<std::uint32_t>& order) {
  constexpr std::size_t kCells = kBeamRows * kBeamColumns;
  const auto count = static_cast<std::uint32_t>(cells.size());
  order.resize(count);
  if (count == 0) return begin_.assign(kCells + 1, 0);
  begin_.resize(kCells + 1);
  // Lidars have beams in a part of the rows only: above and below them, nothing is counted.
  std::uint32_t low = kCells, high = 0;
  for (const std::uint32_t cell : cells) {
    low = std::min(low, cell);
    high = std::max(high, cell + 1);
  }
  std::fill(begin_.begin(), begin_.begin() + high + 1, 0u);
  std::fill(begin_.begin() + high + 1, begin_.end(), count);
  for (const std::uint32_t cell : cells) ++begin_[cell + 1];
  groupBy(high - low, begin_.data() + low, [&](auto&& positionOf) {
    for (std::uint32_t b = 0; b < count; ++b) order[positionOf(cells[b] - low)] = b;
  });
}

void BeamTable::appendCells(int row, int first, int last, std::vector<BeamRange>& ranges) const {
  const std::size_t base = static_cast<std::size_t>(row) * kBeamColumns;
  const BeamRange range{begin_[base + static_cast<std::size_t>(first)],
                        begin_[base + static_cast<std::size_t>(last) + 1]};
  if (range.first < range.last) ranges.push_back(range);
}

void BeamTable::listCells(int first_row, int last_row, const Columns& columns,
                          std::vector<BeamRange>& ranges) const {
  for (int row = first_row; row <= last_row; ++row) {
    if (columns.first <= columns.last) {
      appendCells(row, columns.first, columns.last, ranges);
    } else {  // across the seam
      appendCells(row, columns.first, kBeamColumns - 1, ranges);
      appendCells(row, 0, columns.last, ranges);
    }
  }
}

void BeamTable::query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const {
  ranges.clear();
  if (begin_.empty()) return;
  const Eigen::Vector3d c = centre.cast<double>();
  const double l = radius * (1.0 + kRounding) + kRounding * c.norm();
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
  Columns columns = {0, kBeamColumns - 1};
  if (!pole) {
    const double s = l / rho, k = std::sqrt(1.0 - s * s);
    columns = {columnOf({c.x() * k + c.y() * s, c.y() * k - c.x() * s}),
               columnOf({c.x() * k - c.y() * s, c.y() * k + c.x() * s})};
  }
  listCells(first_row, last_row, columns, ranges);
}

void BeamTable::query(const Eigen::AlignedBox3d& box, std::vector<BeamRange>& ranges) const {
  ranges.clear();
  if (begin_.empty()) return;
  // A margin for the rounding of directions.
  const Eigen::Array3d margin = Eigen::Array3d::Constant(
      kRounding * std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff()));
  const Eigen::Array3d low = box.min().array() - margin, high = box.max().array() + margin;
  const Eigen::Array3d nearest = low.max(-high).max(0.0), farthest = high.max(-low);
  const double rho_min = nearest.head<2>().matrix().norm(), rho_max = farthest.head<2>().matrix().norm();
  if (rho_min == 0.0 && nearest.z() == 0.0) {
    if (begin_.back() > 0) ranges.push_back({0, begin_.back()});
    return;
  }
  const auto rowAt = [](double z, double rho) { return beamRow(static_cast<float>(z / std::hypot(z, rho))); };
  const int first_row = low.z() == 0.0 ? rowAt(0.0, 1.0) : rowAt(low.z(), low.z() > 0.0 ? rho_max : rho_min),
            last_row =
                high.z() == 0.0 ? rowAt(0.0, 1.0) : rowAt(high.z(), high.z() > 0.0 ? rho_min : rho_max);
  Columns columns = {0, kBeamColumns - 1};
  if (rho_min > 0.0) {  // all corners are on one side of a line through the sensor
    const Eigen::Vector2d corners[4] = {
        {low.x(), low.y()}, {high.x(), low.y()}, {low.x(), high.y()}, {high.x(), high.y()}};
    const auto isLeftOf = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      return b.x() * a.y() - b.y() * a.x() > 0.0;
    };
    Eigen::Vector2d first = corners[0], last = corners[0];
    for (const Eigen::Vector2d& corner : corners) {
      if (isLeftOf(first, corner)) first = corner;
      if (isLeftOf(corner, last)) last = corner;
    }
    columns = {columnOf(first), columnOf(last)};
  }
  listCells(first_row, last_row, columns, ranges);
}

}  // namespace bki_mapping
