#include "beams/longest_beams.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {
namespace {

/// A shell ends at this multiple of where it begins: the reach subtends an angle that is larger than it need
/// be by as much.
constexpr float kShellRatio = 1.2f;
/// Where the first shell begins [lengths of the kernel].
constexpr float kFirstShell = 1.5f;
/// Nor does it begin nearer, however short the kernel [voxels].
constexpr float kNearest = 0.5f;
/// Above this angle, bins of the coarse grid are small [rad].
constexpr double kWide = 0.08;
constexpr double kRightAngle = 1.57079632679489661923;
constexpr double kRoom = 1e-5;  ///< for the rounding of sines and angles

double sineOfRow(int row) {
  return 2.0 * row / kBeamRows - 1.0;
}

/// Sets each of a ring of values to the greatest of those up to `width` places before and after it.
void spread(int width, const float* ring, int columns, const LineKernels& kernels, float* to) {
  const int wanted = 2 * width + 1;
  if (wanted >= columns) {
    std::fill_n(to, columns, *std::max_element(ring, ring + columns));
    return;
  }
  // Windows that begin at each place, which grow to twice their size in each step.
  float windows[2][2 * kBeamColumns];
  std::copy(ring + columns - width, ring + columns, windows[0]);
  std::copy(ring, ring + columns, windows[0] + width);
  std::copy(ring, ring + width, windows[0] + width + columns);
  int from = 0;
  for (int size = 1, step; size < wanted; size += step, from = 1 - from) {
    step = std::min(size, wanted - size);
    kernels.find_greater(windows[from], windows[from] + step, columns + wanted - size - step,
                         windows[1 - from]);
  }
  std::copy(windows[from], windows[from] + columns, to);
}

}  // namespace

void LongestBeams::findLengths(const BeamField& field) {
  fine_.lengths.assign(std::size_t{kBeamRows} * kBeamColumns, 0.0f);
  coarse_.lengths.assign(static_cast<std::size_t>(kBeamRows * coarse_.columns), 0.0f);
  const std::size_t count = field.beams().ends.size();
  if (count == 0) {
    with_beams_ = {0, -1};
    return;
  }
  const auto per_metre = static_cast<float>(1.0 / field.geometry().resolution());
  for (std::size_t b = 0; b < count; ++b) {
    const float length = per_metre / field.inverseLengthOf(b);
    const std::uint32_t cell = field.cellOf(b);
    float &of_cell = fine_.lengths[cell], &of_some = coarse_.lengths[cell >> coarse_.shift];
    of_cell = std::max(of_cell, length);
    of_some = std::max(of_some, length);
  }
  const auto rowOf = [&](std::size_t b) { return static_cast<int>(field.cellOf(b)) / kBeamColumns; };
  with_beams_ = {rowOf(0), rowOf(count - 1)};
}

LongestBeams::Rows LongestBeams::rowsNear(int row, const Shell& shell) const {
  const double low = std::asin(sineOfRow(row)) - shell.angle,
               high = std::asin(sineOfRow(row + 1)) + shell.angle;
  const auto rowAt = [](double sine) { return beamRow(static_cast<float>(sine)); };
  return {std::max(low <= -kRightAngle ? 0 : rowAt(std::sin(low) - kRoom), with_beams_.first),
          std::min(high >= kRightAngle ? kBeamRows - 1 : rowAt(std::sin(high) + kRoom), with_beams_.last)};
}

void LongestBeams::setRow(int row, const Shell& shell, const LineKernels& kernels) const {
  const int columns = shell.grid->columns;
  float ring[2][kBeamColumns] = {};
  int from = 0;
  const Rows near = rowsNear(row, shell);
  for (int other = near.first; other <= near.last; ++other, from = 1 - from) {
    kernels.find_greater(ring[from],
                         shell.grid->lengths.data() + static_cast<std::ptrdiff_t>(other) * columns, columns,
                         ring[1 - from]);
  }
  // Equation (9) of docs/method.md; the pseudo-angle grows at most as fast as the azimuth.
  const double sine = std::max(std::abs(sineOfRow(row)), std::abs(sineOfRow(row + 1))),
               cosine = std::sqrt(std::max(1.0 - sine * sine, 0.0)) - kRoom, reach = std::sin(shell.angle);
  const double azimuth = reach >= cosine ? 4.0 : std::asin(reach / cosine) + kRoom;
  spread(static_cast<int>(azimuth * columns / 4.0) + 2, ring[from], columns, kernels,
         shell.lengths + static_cast<std::ptrdiff_t>(row) * columns);
}

void LongestBeams::placeShells(float reach, float farthest) {
  shells_.clear();
  shell_at_.clear();
  std::size_t memory = 0;
  for (float begin = std::max(kFirstShell * reach, kNearest); begin < farthest && shells_.size() < kNone;
       begin *= kShellRatio) {
    // Squares of distances are rounded down to find the shell.
    const double nearest = static_cast<double>(begin),
                 angle = std::asin(static_cast<double>(reach) / nearest) + kRoom;
    const Grid& grid = angle > kWide ? coarse_ : fine_;
    shells_.push_back({begin, angle, &grid, grid.shift, 0, -1, nullptr});
    memory += static_cast<std::size_t>(kBeamRows * grid.columns);
  }
  memory_.resize(memory);
  float* next = memory_.data();
  for (Shell& shell : shells_) {
    shell.lengths = next;
    next += kBeamRows * shell.grid->columns;
  }
  if (shells_.empty()) return;
  shell_at_.resize(static_cast<std::size_t>(farthest * farthest) + 1);
  std::size_t shell = 0;
  for (std::size_t square = 0; square < shell_at_.size(); ++square) {
    const auto at = static_cast<float>(square);
    while (shell + 1 < shells_.size() && shells_[shell + 1].begin * shells_[shell + 1].begin <= at) ++shell;
    shell_at_[square] =
        shells_[shell].begin * shells_[shell].begin <= at ? static_cast<std::uint8_t>(shell) : kNone;
  }
}

void LongestBeams::set(const BeamField& field, float reach, float farthest, const LineKernels& kernels,
                       ThreadPool& pool) {
  placeShells(reach, farthest);
  if (shells_.empty()) return;
  findLengths(field);
  for (Shell& shell : shells_) {
    Rows rows = {0, kBeamRows - 1};
    const auto isPassed = [&](int row) {
      const Rows near = rowsNear(row, shell);
      return near.first <= near.last;
    };
    while (rows.first <= rows.last && !isPassed(rows.first)) ++rows.first;
    while (rows.first <= rows.last && !isPassed(rows.last)) --rows.last;
    shell.first = rows.first * kBeamColumns;
    shell.last = (rows.last + 1) * kBeamColumns - 1;
  }
  constexpr std::size_t kRows = kBeamRows;
  pool.forEach(shells_.size() * kRows, [&](std::size_t n, std::size_t) {
    const Shell& shell = shells_[n / kRows];
    const auto row = static_cast<int>(n % kRows);
    if (row * kBeamColumns >= shell.first && row * kBeamColumns <= shell.last) setRow(row, shell, kernels);
  });
}

}  // namespace bki_mapping
