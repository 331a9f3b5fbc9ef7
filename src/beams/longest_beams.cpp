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
constexpr double kRoom = 1e-5;  ///< for the rounding of sines and angles

double sineOfRow(int row) {
  return 2.0 * row / kBeamRows - 1.0;
}

double cosineOf(double sine) {
  return std::sqrt(std::max(1.0 - sine * sine, 0.0));
}

/// Sets each of a ring of values to the greatest of those up to `width` places before and after it. @param
/// ring those values, with room for `width` before and after them.
void spread(int width, float* ring, int columns, const LineKernels& kernels, float* to) {
  const int wanted = 2 * width + 1;
  if (wanted >= columns) {
    std::fill_n(to, columns, *std::max_element(ring, ring + columns));
    return;
  }
  std::copy(ring + columns - width, ring + columns, ring - width);
  std::copy(ring, ring + width, ring + columns);
  // Windows that begin at each place, which grow to twice their size in each step; the last are wanted.
  float windows[2][2 * kBeamColumns];
  const float* from = ring - width;
  for (int size = 1, step, next = 0; size < wanted; size += step, next = 1 - next) {
    step = std::min(size, wanted - size);
    float* wider = size + step == wanted ? to : windows[next];
    kernels.find_greater(from, from + step, columns + wanted - size - step, wider);
    from = wider;
  }
}

}  // namespace

void LongestBeams::findLengths(const BeamField& field, ThreadPool& pool) {
  const std::size_t count = field.beams().ends.size();
  with_beams_ = {0, -1};
  if (count == 0) return;
  const auto rowOf = [&](std::size_t b) { return static_cast<int>(field.cellOf(b)) / kBeamColumns; };
  with_beams_ = {rowOf(0), rowOf(count - 1)};
  for (Grid* grid : {&fine_, &coarse_}) grid->levels[0].resize(grid->at(kBeamRows));
  const auto per_metre = static_cast<float>(1.0 / field.geometry().resolution());
  const int rows = with_beams_.last - with_beams_.first + 1;
  pool.forEach(static_cast<std::size_t>(rows), [&](std::size_t n, std::size_t) {
    const int row = with_beams_.first + static_cast<int>(n);
    for (Grid* grid : {&fine_, &coarse_})
      std::fill_n(grid->levels[0].data() + grid->at(row), grid->columns, 0.0f);
    const std::size_t first_cell = fine_.at(row), last_cell = fine_.at(row + 1) - 1;
    for (std::size_t b = field.beamsIn(first_cell).first; b < field.beamsIn(last_cell).last; ++b) {
      const float length = per_metre / field.inverseLengthOf(b);
      const std::uint32_t cell = field.cellOf(b);
      float &of_cell = fine_.levels[0][cell], &of_some = coarse_.levels[0][cell >> coarse_.shift];
      of_cell = std::max(of_cell, length);
      of_some = std::max(of_some, length);
    }
  });
}

LongestBeams::Rows LongestBeams::rowsNear(int row, const Shell& shell) const {
  const double low = sineOfRow(row), high = sineOfRow(row + 1);
  const auto rowAt = [](double sine) { return beamRow(static_cast<float>(sine)); };
  // sin(elevation - angle) and sin(elevation + angle), unless they pass a pole.
  const int first = low <= -shell.cosine ? 0 : rowAt(low * shell.cosine - cosineOf(low) * shell.sine - kRoom);
  const int last =
      high >= shell.cosine ? kBeamRows - 1 : rowAt(high * shell.cosine + cosineOf(high) * shell.sine + kRoom);
  return {std::max(first, with_beams_.first), std::min(last, with_beams_.last)};
}

void LongestBeams::setLevels(double rows, Grid& grid, const LineKernels& kernels, ThreadPool& pool) const {
  const int count = with_beams_.last - with_beams_.first + 1;
  for (int level = 1; (1 << level) <= std::min(static_cast<int>(rows), count); ++level) {
    const std::vector<float>& from = grid.levels[static_cast<std::size_t>(level - 1)];
    std::vector<float>& to = grid.levels[static_cast<std::size_t>(level)];
    to.resize(from.size());
    pool.forEach(static_cast<std::size_t>(count), [&](std::size_t n, std::size_t) {
      const int row = with_beams_.first + static_cast<int>(n),
                next = std::min(row + (1 << (level - 1)), with_beams_.last);
      kernels.find_greater(from.data() + grid.at(row), from.data() + grid.at(next), grid.columns,
                           to.data() + grid.at(row));
    });
  }
}

void LongestBeams::setRow(int row, const Shell& shell, const LineKernels& kernels) const {
  const int columns = shell.grid->columns;
  // Two windows of a level cover the rows; they may overlap.
  const Rows near = rowsNear(row, shell);
  const int level = 31 - __builtin_clz(static_cast<unsigned>(near.last - near.first + 1));
  const float* lengths = shell.grid->levels[static_cast<std::size_t>(level)].data();
  float memory[3 * kBeamColumns];
  float* ring = memory + kBeamColumns;
  kernels.find_greater(lengths + shell.grid->at(near.first),
                       lengths + shell.grid->at(near.last + 1 - (1 << level)), columns, ring);
  // Equation (9) of docs/method.md; the pseudo-angle grows at most as fast as the azimuth.
  const double sine = std::max(std::abs(sineOfRow(row)), std::abs(sineOfRow(row + 1))),
               cosine = cosineOf(sine) - kRoom;
  const double azimuth = shell.sine >= cosine ? 4.0 : std::asin(shell.sine / cosine) + kRoom;
  spread(static_cast<int>(azimuth * columns / 4.0) + 2, ring, columns, kernels,
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
    shells_.push_back({begin, std::sin(angle), std::cos(angle), &grid, grid.shift, 0, -1, nullptr});
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
  findLengths(field, pool);
  // Each grid's first shell has the largest angle. Windows span its sine in both directions.
  const auto setLevelsOf = [&](Grid& grid) {
    const auto isOf = [&](const Shell& shell) { return shell.grid == &grid; };
    const auto first = std::find_if(shells_.begin(), shells_.end(), isOf);
    if (first != shells_.end()) setLevels(first->sine * kBeamRows + 3.0, grid, kernels, pool);
  };
  setLevelsOf(coarse_);
  setLevelsOf(fine_);
  pool.forEach(shells_.size(), [&](std::size_t n, std::size_t) {
    Shell& shell = shells_[n];
    Rows rows = {0, kBeamRows - 1};
    const auto isPassed = [&](int row) {
      const Rows near = rowsNear(row, shell);
      return near.first <= near.last;
    };
    while (rows.first <= rows.last && !isPassed(rows.first)) ++rows.first;
    while (rows.first <= rows.last && !isPassed(rows.last)) --rows.last;
    shell.first = rows.first * kBeamColumns;
    shell.last = (rows.last + 1) * kBeamColumns - 1;
  });
  constexpr std::size_t kRows = kBeamRows;
  pool.forEach(shells_.size() * kRows, [&](std::size_t n, std::size_t) {
    const Shell& shell = shells_[n / kRows];
    const auto row = static_cast<int>(n % kRows);
    if (row * kBeamColumns >= shell.first && row * kBeamColumns <= shell.last) setRow(row, shell, kernels);
  });
}

}  // namespace bki_mapping
