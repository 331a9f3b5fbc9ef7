#include "journal/point_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "journal/zigzag.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kSample = 500, kMostRows = 256;
/// What a row takes that is not the next one [bits].
constexpr double kBitsForRow = 8.0;

double azimuthBetween(const SensorScan::Coordinates& a, const SensorScan::Coordinates& b) {
  const double ax = a[0], ay = a[1], bx = b[0], by = b[1];
  return std::atan2(ax * by - ay * bx, ax * bx + ay * by);
}
double elevationOf(const SensorScan::Coordinates& point) {
  const double x = point[0], y = point[1], z = point[2];
  return std::atan2(z, std::sqrt(x * x + y * y));
}

/// Calls visit(before, point) for pairs that follow each other, all over the scan.
template <typename Visit>
void forSample(const ScanPoints& points, const PointOrder& order, Visit&& visit) {
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kSample);
  for (std::size_t n = 1; n < points.size(); n += stride) visit(points[order.at(n - 1)], points[order.at(n)]);
}

/// Whether points that follow each other differ in elevation rather than in azimuth.
bool isByColumns(const ScanPoints& points) {
  int columns = 0, all = 0;
  forSample(points, {}, [&](const auto& before, const auto& point) {
    columns += std::abs(elevationOf(point) - elevationOf(before)) > std::abs(azimuthBetween(before, point));
    ++all;
  });
  return 2 * columns > all;
}

/// The rows of a lidar are peaks of the histogram of elevations.
/// @return for each bin the number of its row.
std::vector<std::uint32_t> peaksOf(const std::vector<std::uint32_t>& histogram) {
  constexpr std::uint32_t kNoise = 32;
  const auto isBelow = [](std::uint32_t valley, std::uint32_t peak) { return 3 * valley < 2 * peak; };
  std::vector<std::uint32_t> row_of(histogram.size());
  std::uint32_t row = 0, peak = 0, valley = 0;
  std::size_t lowest = 0;
  for (std::size_t bin = 1; bin + 1 < histogram.size(); ++bin) {
    const std::uint32_t here = histogram[bin - 1] + 2 * histogram[bin] + histogram[bin + 1];
    if (here > peak) {
      peak = valley = here;
    } else if (here < valley) {
      valley = here;
      lowest = bin;
    } else if (isBelow(valley, peak) && isBelow(valley + kNoise, here)) {
      ++row;
      std::fill(row_of.begin() + static_cast<std::ptrdiff_t>(lowest),
                row_of.begin() + static_cast<std::ptrdiff_t>(bin), row);
      peak = valley = here;
    }
    row_of[bin] = row;
  }
  row_of.back() = row;
  return row_of;
}

/// The row of each point; none if there are too many.
std::vector<std::uint8_t> rowOfEach(const ScanPoints& points) {
  constexpr std::size_t kHalf = 2048;  // bins of the sine of an elevation from 0 to 1
  std::vector<std::uint32_t> histogram(2 * kHalf + 1, 0);
  std::vector<std::uint16_t> bins(points.size());
  for (std::size_t n = 0; n < points.size(); ++n) {
    const auto x = static_cast<float>(points[n][0]), y = static_cast<float>(points[n][1]),
               z = static_cast<float>(points[n][2]);
    const float squared = x * x + y * y + z * z;
    const float sine = squared > 0.0f ? z / std::sqrt(squared) : 0.0f;
    bins[n] = static_cast<std::uint16_t>(kHalf * std::clamp(1.0f + sine, 0.0f, 2.0f));
    ++histogram[bins[n]];
  }
  const std::vector<std::uint32_t> peak_of = peaksOf(histogram);
  std::vector<std::uint32_t> row_of(peak_of.back() + 1, kMostRows);  // numbered as they appear
  std::uint32_t count = 0;
  std::vector<std::uint8_t> rows(points.size());
  for (std::size_t n = 0; n < points.size(); ++n) {
    std::uint32_t& row = row_of[peak_of[bins[n]]];
    if (row == kMostRows) row = count++;
    if (count > kMostRows) return {};
    rows[n] = static_cast<std::uint8_t>(row);
  }
  return rows;
}

/// The usual turn between points that follow each other.
PointStep usualStep(const ScanPoints& points, const PointOrder& order) {
  std::vector<double> turns;
  forSample(points, order,
            [&](const auto& before, const auto& point) { turns.push_back(azimuthBetween(before, point)); });
  const auto middle = turns.begin() + static_cast<std::ptrdiff_t>(turns.size() / 2);
  std::nth_element(turns.begin(), middle, turns.end());
  return {static_cast<std::int32_t>(std::lround(PointStep::kOne * std::cos(*middle))),
          static_cast<std::int32_t>(std::lround(PointStep::kOne * std::sin(*middle))), true};
}

/// Bits of the errors of guesses, a point.
double errorBits(const ScanPoints& points, const PointOrder& order, const PointStep& step) {
  int bits = 0, all = 0;
  const auto add = [&](std::int32_t is, std::int32_t guessed) {
    for (std::uint32_t error = zigzagBetween(guessed, is); error != 0; error >>= 1) ++bits;
  };
  forSample(points, order, [&](const auto& before, const auto& point) {
    NextPoint next(before, step);
    const auto [first, second, third] = next.axes();
    add(point[first], next.first());
    next.setFirst(point[first]);
    add(point[second], next.other(second));
    add(point[third], next.other(third));
    ++all;
  });
  return static_cast<double>(bits) / all;
}

/// Bits of the rows, a point.
double rowBits(const std::vector<std::uint8_t>& rows) {
  std::size_t others = 0;
  for (std::size_t n = 1; n < rows.size(); ++n)
    others += rows[n] != static_cast<std::uint8_t>(rows[n - 1] + 1);
  return rows.empty() ? 0.0 : kBitsForRow * static_cast<double>(others) / static_cast<double>(rows.size());
}

}  // namespace

std::vector<std::uint32_t> rowByRow(const std::vector<std::uint8_t>& rows) {
  std::array<std::uint32_t, kMostRows + 1> next = {};
  for (const std::uint8_t row : rows) ++next[row + 1u];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<std::uint32_t> points(rows.size());
  for (std::size_t n = 0; n < rows.size(); ++n) points[next[rows[n]]++] = static_cast<std::uint32_t>(n);
  return points;
}

PointOrder chooseOrder(const ScanPoints& points) {
  if (points.size() < 2) return {};
  std::vector<PointOrder> orders(1);
  if (isByColumns(points)) {
    PointOrder by_rows;
    by_rows.rows = rowOfEach(points);
    by_rows.points = rowByRow(by_rows.rows);
    if (!by_rows.rows.empty()) orders.push_back(std::move(by_rows));
  }
  PointOrder* best = nullptr;
  double least = 0.0;
  for (PointOrder& order : orders) {
    const double rows = rowBits(order.rows);
    for (const PointStep& step : {PointStep(), usualStep(points, order)}) {
      const double bits = errorBits(points, order, step) + rows;
      if (best && bits >= least) continue;
      best = &order;
      least = bits;
      order.step = step;
    }
  }
  return std::move(*best);
}

}  // namespace bki_mapping
