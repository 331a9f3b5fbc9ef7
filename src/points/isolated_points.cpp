#include "points/isolated_points.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/pi.h"
#include "parallel/chunks.h"

namespace bki_mapping {
namespace {

constexpr std::uint32_t kNoCell = 0xffffffffu;
constexpr float kRowsPerUnit = 0.5f * DirectionCells::kRows;

/// The azimuth as a part of the full turn, from 0 to 1; wrong by at most 0.3 degrees.
float turnOf(float x, float y) {
  const float ax = std::abs(x), ay = std::abs(y), larger = std::max(ax, ay);
  if (!(larger > 0.0f)) return 0.0f;
  const float t = std::min(ax, ay) / larger;
  // atan(t) = pi/4 t + 0.273 t (1 - t), in turns
  const float octant = t * (0.125f + 0.04345f * (1.0f - t));
  const float quadrant = ay > ax ? 0.25f - octant : octant;
  const float half = x < 0.0f ? 0.5f - quadrant : quadrant;
  return y < 0.0f ? 1.0f - half : half;
}

/// The beams of some cells by the slices in which they end.
class Profile {
 public:
  Profile() { all_.fill(0), support_.fill(0); }
  void add(std::uint8_t slice, std::uint32_t beams, std::uint32_t support) {
    all_[slice + kMargin] += beams;
    support_[slice + kMargin] += support;
  }
  void accumulate() {
    for (std::size_t s = all_.size() - 1; s > 0; --s) all_[s - 1] += all_[s];
  }
  /// Number of others that end in a slice or one of those beside it.
  float near(std::uint8_t slice) const {
    const std::size_t at = slice + kMargin;
    return static_cast<float>(support_[at - 1] + support_[at] + support_[at + 1] - 1);
  }
  /// Number of others that end there or farther away.
  float reaching(std::uint8_t slice) const { return static_cast<float>(all_[slice + kMargin - 2] - 1); }

 private:
  static constexpr std::size_t kMargin = 2;
  std::array<std::uint32_t, IsolatedPoints::kSlices + 2 * kMargin> all_, support_;
};

}  // namespace

DirectionCells::DirectionCells() {
  for (int row = 0; row < kRows; ++row) {
    const double z = (row + 0.5) / kRowsPerUnit - 1.0;
    const double columns = std::round(kPi * kRows * std::sqrt(1.0 - z * z));
    begin_[static_cast<std::size_t>(row) + 1] =
        begin_[static_cast<std::size_t>(row)] + static_cast<std::uint32_t>(std::max(columns, 1.0));
    row_of_.resize(begin_[static_cast<std::size_t>(row) + 1], static_cast<std::uint8_t>(row));
  }
}

std::uint32_t DirectionCells::cellOf(const Eigen::Vector3f& point, float length) const {
  const int row = std::clamp(static_cast<int>((point.z() / length + 1.0f) * kRowsPerUnit), 0, kRows - 1);
  const std::uint32_t first = begin_[static_cast<std::size_t>(row)];
  const int columns = rowOf(first).columns;
  const int column = static_cast<int>(turnOf(point.x(), point.y()) * static_cast<float>(columns));
  return first + static_cast<std::uint32_t>(std::min(column, columns - 1));
}

std::uint8_t DirectionCells::halfOf(const Eigen::Vector3f& point, std::uint32_t cell) const {
  const Row row = rowOf(cell);
  const float columns = turnOf(point.x(), point.y()) * static_cast<float>(row.columns);
  return columns - static_cast<float>(cell - row.begin) < 0.5f ? 0 : 1;
}

int IsolatedPoints::sliceOf(float range) {
  // The leading bits of a float are a logarithm: 64 slices for each factor of two, from 2 m on.
  const float shifted = range + 2.0f;
  std::uint32_t bits = 0;
  std::memcpy(&bits, &shifted, sizeof(bits));
  return static_cast<int>(std::min<std::uint32_t>((bits >> 17) - (0x40000000u >> 17), kSlices - 1));
}

void IsolatedPoints::sortIntoCells(Span<const Eigen::Vector3f> points, ThreadPool& pool) {
  const Chunks chunks(points.size());
  cell_of_.resize(points.size());
  half_of_.resize(points.size());
  slice_of_.resize(points.size());
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i) {
      const float range = points[i].norm();
      const bool is_beam = range >= 1e-3f && range < 1e6f;  // neither NaN nor infinite
      cell_of_[i] = is_beam ? cells_.cellOf(points[i], range) : kNoCell;
      half_of_[i] = is_beam ? cells_.halfOf(points[i], cell_of_[i]) : std::uint8_t{0};
      slice_of_[i] = static_cast<std::uint8_t>(is_beam ? sliceOf(range) : 0);
    }
  });
  begin_.assign(cells_.size() + 1, 0);
  for (const std::uint32_t cell : cell_of_) {
    if (cell != kNoCell) ++begin_[cell + 1];
  }
  for (std::size_t c = 0; c < cells_.size(); ++c) begin_[c + 1] += begin_[c];
  point_of_.resize(begin_[cells_.size()]);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (cell_of_[i] != kNoCell) point_of_[begin_[cell_of_[i]]++] = static_cast<std::uint32_t>(i);
  }
  for (std::size_t c = cells_.size(); c > 0; --c) begin_[c] = begin_[c - 1];
  begin_[0] = 0;
}

void IsolatedPoints::makeGroups(std::uint32_t cell) {
  std::array<std::uint16_t, 2 * kSlices>
      known;  // 1 + number of the group of a half and slice, if there is one
  Group* const groups = groups_.data() + begin_[cell];
  known.fill(0);
  std::uint16_t count = 0;
  for (std::uint32_t n = begin_[cell]; n < begin_[cell + 1]; ++n) {
    const std::uint8_t half = half_of_[point_of_[n]], slice = slice_of_[point_of_[n]];
    std::uint16_t& group = known[static_cast<std::size_t>(half * kSlices + slice)];
    if (group == 0) {
      groups[count] = {half, slice, 0, 0, 0};
      group = ++count;
    }
    ++groups[group - 1].beams;
  }
  group_count_[cell] = count;
}

bool IsolatedPoints::areAllSupported(std::uint32_t cell, int last_slice) const {
  constexpr std::size_t kMargin = 1;
  std::array<std::uint32_t, kSlices + 2 * kMargin> beams;
  beams.fill(0);
  std::uint32_t all = 0;
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row&) {
    all += begin_[last + 1] - begin_[first];
    for (std::uint32_t c = first; c <= last; ++c) {
      const Group* const groups = groups_.data() + begin_[c];
      for (int g = 0; g < group_count_[c]; ++g) beams[groups[g].slice + kMargin] += groups[g].beams;
    }
  });
  const float enough = kOfSquareRoot * std::sqrt(static_cast<float>(all)) + 1.0f;
  const Group* const groups = groups_.data() + begin_[cell];
  return std::all_of(groups, groups + group_count_[cell], [&](const Group& group) {
    const std::size_t at = group.slice + kMargin;
    return group.slice >= last_slice ||
           static_cast<float>(beams[at - 1] + beams[at] + beams[at + 1]) >= enough;
  });
}

void IsolatedPoints::decide(std::uint32_t cell, int last_slice, bool second) {
  Group* const groups = groups_.data() + begin_[cell];
  const Group* const end = groups + group_count_[cell];
  const auto isOpen = [&](const Group& group) {
    return group.slice < last_slice && !(second && group.isolated);
  };
  if (std::none_of(static_cast<const Group*>(groups), end, isOpen)) return;
  if (second) {
    bool any = false;
    cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row&) {
      for (std::uint32_t c = first; c <= last; ++c) any |= any_isolated_[c] != 0;
    });
    if (!any) return;
  }
  if (!second && areAllSupported(cell, last_slice)) return;
  const DirectionCells::Row own = cells_.rowOf(cell);
  const int own_column = static_cast<int>(cell - own.begin);
  Profile window, row_strip, column_strips[2];  // the latter for the two halves of the cell
  std::uint32_t beams = 0;
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row& row) {
    const int halves = 2 * row.columns;
    // Of the two halves of the cell, those of the row at the same azimuth.
    const int same[2] = {(4 * own_column + 1) * row.columns / (2 * own.columns),
                         (4 * own_column + 3) * row.columns / (2 * own.columns)};
    for (std::uint32_t c = first; c <= last; ++c) {
      const Group* const others = groups_.data() + begin_[c];
      for (int g = 0; g < group_count_[c]; ++g) {
        const Group& other = others[g];
        const std::uint32_t supporting = second && other.isolated ? 0 : other.beams;
        beams += other.beams;
        window.add(other.slice, other.beams, supporting);
        if (row.begin == own.begin) row_strip.add(other.slice, other.beams, supporting);
        for (int half = 0; half < 2; ++half) {
          const int apart = std::abs(2 * static_cast<int>(c - row.begin) + other.half - same[half]);
          if (std::min(apart, halves - apart) <= 1)
            column_strips[half].add(other.slice, other.beams, supporting);
        }
      }
    }
  });
  if (beams <= kFewestAround) return;
  for (Profile* profile : {&window, &row_strip, &column_strips[0], &column_strips[1]}) profile->accumulate();
  for (Group* group = groups; group != end; ++group) {
    if (!isOpen(*group)) continue;
    const auto isLine = [&](const Profile& strip) {
      return strip.near(group->slice) >= std::max(kOfStrip * strip.reaching(group->slice), kLeastOfStrip);
    };
    const float enough = kOfSquareRoot * std::sqrt(window.reaching(group->slice));
    const bool few = window.near(group->slice) < std::max(enough, 1.0f) && !isLine(row_strip) &&
                     !isLine(column_strips[group->half]);
    group->isolated_after = few;
    if (second) continue;
    group->isolated = few;
    any_isolated_[cell] |= static_cast<std::uint8_t>(few);
  }
}

void IsolatedPoints::markPoints(std::uint32_t cell) {
  const Group* const groups = groups_.data() + begin_[cell];
  for (int g = 0; g < group_count_[cell]; ++g) {
    if (!groups[g].isolated && !groups[g].isolated_after) continue;
    for (std::uint32_t n = begin_[cell]; n < begin_[cell + 1]; ++n) {
      const std::uint32_t point = point_of_[n];
      if (half_of_[point] == groups[g].half && slice_of_[point] == groups[g].slice) isolated_[point] = 1;
    }
  }
}

const std::vector<std::uint8_t>& IsolatedPoints::find(Span<const Eigen::Vector3f> points, float within,
                                                      ThreadPool& pool) {
  sortIntoCells(points, pool);
  groups_.resize(point_of_.size());
  group_count_.resize(cells_.size());
  any_isolated_.assign(cells_.size(), 0);
  isolated_.assign(points.size(), 0);
  const int last_slice = sliceOf(within);
  const auto forEachCell = [&](auto&& visit) {
    constexpr std::size_t kParts = 64;
    pool.forEach(kParts, [&](std::size_t part, std::size_t) {
      const std::size_t end = (part + 1) * cells_.size() / kParts;
      for (std::size_t c = part * cells_.size() / kParts; c < end; ++c) {
        if (begin_[c] < begin_[c + 1]) visit(static_cast<std::uint32_t>(c));
      }
    });
  };
  std::fill(group_count_.begin(), group_count_.end(), std::uint16_t{0});
  forEachCell([&](std::uint32_t cell) { makeGroups(cell); });
  forEachCell([&](std::uint32_t cell) { decide(cell, last_slice, false); });
  forEachCell([&](std::uint32_t cell) { decide(cell, last_slice, true); });
  forEachCell([&](std::uint32_t cell) { markPoints(cell); });
  return isolated_;
}

}  // namespace bki_mapping
