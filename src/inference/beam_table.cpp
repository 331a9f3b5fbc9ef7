#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bki_mapping/inference/beam_index.h"

namespace bki_mapping {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kRows = 512;     ///< of sin(elevation), from -1 to 1
constexpr int kColumns = 720;  ///< of the azimuth's pseudo-angle, from 0 to 4
/// Room for rounding of angles [rad].
constexpr double kMargin = 1e-5;

int rowOf(double sine) {
  return std::clamp(static_cast<int>((sine * 0.5 + 0.5) * kRows), 0, kRows - 1);
}

/// Grows with the azimuth, from 0 at -pi to 4 at pi, by 1 a quadrant: the azimuth without its arc tangent.
template <typename T>
T pseudoAngle(T x, T y) {
  const T sum = std::abs(x) + std::abs(y);
  const T share = sum > T(0) ? y / sum : T(0);
  if (x >= T(0)) return T(2) + share;
  return y >= T(0) ? T(4) - share : -share;
}

int columnOf(double pseudo_angle) {
  return std::clamp(static_cast<int>(pseudo_angle * (kColumns / 4)), 0, kColumns - 1);
}
int columnAt(double azimuth) {
  return columnOf(pseudoAngle(std::cos(azimuth), std::sin(azimuth)));
}

std::uint32_t cellOf(const Eigen::Vector3f& u) {
  return static_cast<std::uint32_t>(rowOf(u.z()) * kColumns + columnOf(pseudoAngle(u.x(), u.y())));
}

}  // namespace

std::vector<std::uint32_t> sortedByDirection(const std::vector<Eigen::Vector3f>& directions) {
  // A counting sort by cell.
  std::vector<std::uint32_t> cells, next(kRows * kColumns + 1, 0), order(directions.size());
  cells.reserve(directions.size());
  for (const Eigen::Vector3f& u : directions) {
    cells.push_back(cellOf(u));
    ++next[cells.back() + 1];
  }
  for (std::size_t c = 1; c < next.size(); ++c) next[c] += next[c - 1];
  for (std::uint32_t b = 0; b < cells.size(); ++b) order[next[cells[b]]++] = b;
  return order;
}

BeamTable::BeamTable(const std::vector<Eigen::Vector3f>& directions) : begin_(kRows * kColumns + 1, 0) {
  std::uint32_t last = 0;
  for (const Eigen::Vector3f& u : directions) {
    const std::uint32_t cell = cellOf(u);
    if (cell < last)
      throw std::invalid_argument("BeamTable needs directions in the order of sortedByDirection");
    last = cell;
    ++begin_[cell + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
}

void BeamTable::appendCells(int row, int first, int last, std::vector<BeamRange>& ranges) const {
  const std::size_t base = static_cast<std::size_t>(row) * kColumns;
  const BeamRange range{begin_[base + static_cast<std::size_t>(first)],
                        begin_[base + static_cast<std::size_t>(last) + 1]};
  if (range.first < range.last) ranges.push_back(range);
}

void BeamTable::query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const {
  ranges.clear();
  const double distance = centre.cast<double>().norm();
  if (distance <= radius * (1.0 + 1e-6)) {
    if (begin_.back() > 0) ranges.push_back({0, begin_.back()});
    return;
  }
  // A ball of radius l at distance r subtends delta = asin(l / r) in elevation, and in azimuth
  // asin(sin(delta) / cos(theta)), or the whole circle where it covers a pole.
  const double theta = std::asin(std::clamp(centre.z() / distance, -1.0, 1.0));
  const double delta = std::asin(radius / distance) + kMargin;
  const double azimuth = std::atan2(centre.y(), centre.x());
  double half_width = kPi;
  if (std::abs(theta) + delta < kPi / 2) {
    half_width = std::asin(std::min(1.0, std::sin(delta) / std::cos(theta))) + kMargin;
  }
  const int first_row = rowOf(std::sin(std::max(theta - delta, -kPi / 2)));
  const int last_row = rowOf(std::sin(std::min(theta + delta, kPi / 2)));
  const bool whole = half_width > 0.99 * kPi;
  const int first = whole ? 0 : columnAt(azimuth - half_width);
  const int last = whole ? kColumns - 1 : columnAt(azimuth + half_width);
  const bool over_seam = !whole && (azimuth - half_width < -kPi || azimuth + half_width > kPi);
  for (int row = first_row; row <= last_row; ++row) {
    if (!over_seam) {
      appendCells(row, first, last, ranges);
    } else if (last >= first) {  // all columns, in one piece
      appendCells(row, 0, kColumns - 1, ranges);
    } else {
      appendCells(row, first, kColumns - 1, ranges);
      appendCells(row, 0, last, ranges);
    }
  }
}

}  // namespace bki_mapping
