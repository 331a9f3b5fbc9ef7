#include <algorithm>
#include <cmath>

#include "bki_mapping/inference/beam_index.h"

namespace bki_mapping {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kRows = 360;     ///< of elevation, from -pi/2 to pi/2
constexpr int kColumns = 720;  ///< of azimuth, from -pi to pi
/// Room for rounding of angles [rad].
constexpr double kMargin = 1e-5;

int rowOf(double elevation) {
  return std::clamp(static_cast<int>((elevation / kPi + 0.5) * kRows), 0, kRows - 1);
}

/// Not yet wrapped: a window about the seam reaches below 0 or beyond the last column.
int columnOf(double azimuth) {
  return static_cast<int>(std::floor((azimuth / (2 * kPi) + 0.5) * kColumns));
}

double elevationOf(const Eigen::Vector3f& v) {
  return std::atan2(v.z(), std::hypot(v.x(), v.y()));
}
double azimuthOf(const Eigen::Vector3f& v) {
  return std::atan2(v.y(), v.x());
}

}  // namespace

BeamTable::BeamTable(const std::vector<Eigen::Vector3f>& directions)
    : begin_(kRows * kColumns + 1, 0), beams_(directions.size()) {
  std::vector<std::uint32_t> cells;
  cells.reserve(directions.size());
  for (const Eigen::Vector3f& u : directions) {
    const int column = std::clamp(columnOf(azimuthOf(u)), 0, kColumns - 1);
    cells.push_back(static_cast<std::uint32_t>(rowOf(elevationOf(u)) * kColumns + column));
    ++begin_[cells.back() + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t b = 0; b < cells.size(); ++b) beams_[next[cells[b]]++] = b;
}

void BeamTable::appendCells(int row, int first, int last, std::vector<std::uint32_t>& beams) const {
  const std::size_t base = static_cast<std::size_t>(row) * kColumns;
  beams.insert(beams.end(), beams_.begin() + begin_[base + static_cast<std::size_t>(first)],
               beams_.begin() + begin_[base + static_cast<std::size_t>(last) + 1]);
}

void BeamTable::query(const Eigen::Vector3f& centre, float radius, std::vector<std::uint32_t>& beams) const {
  beams.clear();
  const double distance = centre.cast<double>().norm();
  if (distance <= radius * (1.0 + 1e-6)) {
    beams = beams_;
    return;
  }
  // A ball of radius l at distance r subtends delta = asin(l / r) in elevation, and in azimuth
  // asin(sin(delta) / cos(theta)), or the whole circle where it covers a pole.
  const double theta = elevationOf(centre);
  const double delta = std::asin(radius / distance) + kMargin;
  double half_width = kPi;
  if (std::abs(theta) + delta < kPi / 2) {
    half_width = std::asin(std::min(1.0, std::sin(delta) / std::cos(theta))) + kMargin;
  }
  const int first = columnOf(azimuthOf(centre) - half_width);
  const int last = columnOf(azimuthOf(centre) + half_width);
  for (int row = rowOf(theta - delta); row <= rowOf(theta + delta); ++row) {
    if (last - first + 1 >= kColumns) {
      appendCells(row, 0, kColumns - 1, beams);
      continue;
    }
    appendCells(row, std::max(first, 0), std::min(last, kColumns - 1), beams);
    if (first < 0) appendCells(row, first + kColumns, kColumns - 1, beams);
    if (last >= kColumns) appendCells(row, 0, last - kColumns, beams);
  }
}

}  // namespace bki_mapping
