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

/// The azimuth as a part of the full turn, from 0 to 1; wrong by at most 0.3 degrees. Without branches, so
/// that compilers vectorise loops over it.
float turnOf(float x, float y) {
  const float ax = std::abs(x), ay = std::abs(y), larger = ax < ay ? ay : ax, smaller = ay < ax ? ay : ax;
  const float t = larger > 0.0f ? smaller / larger : 0.0f;
  // atan(t) = pi/4 t + 0.273 t (1 - t), in turns
  const float octant = t * (0.125f + 0.04345f * (1.0f - t));
  const float quadrant = ay > ax ? 0.25f - octant : octant;
  const float half = x < 0.0f ? 0.5f - quadrant : quadrant;
  return y < 0.0f ? 1.0f - half : half;
}

float rowAt(float z, float length) {
  return (z / length + 1.0f) * kRowsPerUnit;
}

/// The beams of some cells by the slices in which they end, around some slices.
class Profile {
 public:
  /// @param first, last slices of which it will be asked.
  Profile(int first, int last)
      : first_(static_cast<std::size_t>(first)), last_(static_cast<std::size_t>(last) + 2 * kMargin) {
    std::fill(all_.begin() + first, all_.begin() + last + 2 * kMargin + 1, 0u);
    std::fill(support_.begin() + first, support_.begin() + last + 2 * kMargin + 1, 0u);
  }
  /// Whether beams that end there make a difference.
  bool asksFor(std::uint8_t slice) const { return slice + kMargin >= first_; }
  void add(std::uint8_t slice, std::uint32_t beams, std::uint32_t support) {
    const std::size_t at = std::min(slice + kMargin, last_);
    all_[at] += beams;
    support_[at] += support;
  }
  void accumulate() {
    for (std::size_t s = last_; s > first_; --s) all_[s - 1] += all_[s];
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
  std::size_t first_, last_;  ///< with the margin; the last one has also all that is farther away
  std::array<std::uint32_t, IsolatedPoints::kSlices + 2 * kMargin> all_, support_;
};

/// Whether the beams of a strip that end near a slice are enough for a line.
bool isLine(const Profile& strip, std::uint8_t slice, float strictness) {
  const float least = IsolatedPoints::kOfStrip * strip.reaching(slice);
  return strip.near(slice) >= strictness * std::max(least, IsolatedPoints::kLeastOfStrip);
}

}  // namespace

DirectionCells::DirectionCells() {
  for (int row = 0; row < kRows; ++row) {
    const double z = (row + 0.5) / kRowsPerUnit - 1.0;
    const double columns = std::round(kPi * kRows * std::sqrt(1.0 - z * z));
    const auto r = static_cast<std::size_t>(row);
    begin_[r + 1] = begin_[r] + static_cast<std::uint32_t>(std::max(columns, 1.0));
    columns_[r] = static_cast<float>(begin_[r + 1] - begin_[r]);
    row_of_.resize(begin_[r + 1], static_cast<std::uint8_t>(row));
  }
}

DirectionCells::Place DirectionCells::placeOf(const Eigen::Vector3f& point, float length) const {
  return placeOf(rowAt(point.z(), length), turnOf(point.x(), point.y()));
}

int IsolatedPoints::sliceOf(float range) {
  // The leading bits of a float are a logarithm: 64 slices for each factor of two, from 2 m on.
  const float shifted = range + 2.0f;
  std::uint32_t bits = 0;
  std::memcpy(&bits, &shifted, sizeof(bits));
  return static_cast<int>(std::min<std::uint32_t>((bits >> 17) - (0x40000000u >> 17), kSlices - 1));
}

void IsolatedPoints::findPlaces(const Eigen::Vector3f* points, std::size_t count, int farthest,
                                std::uint32_t* cells, std::uint16_t* keys) const {
  constexpr std::size_t kAtOnce = 64;
  float x[kAtOnce], y[kAtOnce], z[kAtOnce], ranges[kAtOnce], rows[kAtOnce], turns[kAtOnce];
  for (std::size_t begin = 0; begin < count; begin += kAtOnce) {
    const std::size_t size = std::min(kAtOnce, count - begin);
    for (std::size_t i = 0; i < size; ++i) {
      x[i] = points[begin + i].x();
      y[i] = points[begin + i].y();
      z[i] = points[begin + i].z();
    }
    for (std::size_t i = 0; i < size; ++i) {
      ranges[i] = std::sqrt(x[i] * x[i] + (y[i] * y[i] + z[i] * z[i]));  // as Eigen has it
      rows[i] = rowAt(z[i], ranges[i]);
      turns[i] = turnOf(x[i], y[i]);
    }
    for (std::size_t i = 0; i < size; ++i) {
      const bool is_beam = ranges[i] >= 1e-3f && ranges[i] < 1e6f;  // neither NaN nor infinite
      const auto [cell, half] =
          is_beam ? cells_.placeOf(rows[i], turns[i]) : DirectionCells::Place{kNoCell, 0};
      cells[begin + i] = cell;
      keys[begin + i] = is_beam ? keyOf(half, std::min(sliceOf(ranges[i]), farthest)) : std::uint16_t{0};
    }
  }
}

void IsolatedPoints::sortIntoCells(Span<const Eigen::Vector3f> points, int farthest, ThreadPool& pool) {
  const Chunks chunks(points.size());
  cell_of_.resize(points.size());
  key_of_.resize(points.size());
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    const std::size_t begin = chunks.begin(c);
    findPlaces(points.begin() + begin, chunks.end(c) - begin, farthest, cell_of_.data() + begin,
               key_of_.data() + begin);
  });
  begin_.assign(cells_.size() + 1, 0);
  for (const std::uint32_t cell : cell_of_) {
    if (cell != kNoCell) ++begin_[cell + 1];
  }
  for (std::size_t c = 0; c < cells_.size(); ++c) begin_[c + 1] += begin_[c];
  point_of_.resize(begin_[cells_.size()]);
  sorted_keys_.resize(point_of_.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (cell_of_[i] == kNoCell) continue;
    const std::uint32_t at = begin_[cell_of_[i]]++;
    point_of_[at] = static_cast<std::uint32_t>(i);
    sorted_keys_[at] = key_of_[i];
  }
  for (std::size_t c = cells_.size(); c > 0; --c) begin_[c] = begin_[c - 1];
  begin_[0] = 0;
}

void IsolatedPoints::makeGroups(std::uint32_t cell) {
  std::array<std::uint16_t, 2 * kSlices> known;  // 1 + number of the group with a key, if there is one
  Group* const groups = groups_.data() + begin_[cell];
  known.fill(0);
  std::uint16_t count = 0;
  for (std::uint32_t n = begin_[cell]; n < begin_[cell + 1]; ++n) {
    const std::uint16_t key = sorted_keys_[n];
    std::uint16_t& group = known[key];
    if (group == 0) {
      groups[count] = {
          static_cast<std::uint8_t>(key / kSlices), static_cast<std::uint8_t>(key % kSlices), 0, 0, 1, 0};
      group = ++count;
    }
    ++groups[group - 1].beams;
  }
  group_count_[cell] = count;
}

bool IsolatedPoints::areAllSupported(std::uint32_t cell, const Pass& pass) const {
  constexpr std::size_t kMargin = 1;
  std::array<std::uint32_t, kSlices + 2 * kMargin> beams;
  beams.fill(0);
  std::uint32_t all = 0;
  const DirectionCells::Row own = cells_.rowOf(cell);
  const auto addRange = [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t c = first; c <= last; ++c) {
      const Group* const groups = groups_.data() + begin_[c];
      for (int g = 0; g < group_count_[c]; ++g) {
        beams[groups[g].slice + kMargin] += pass.supportOf(groups[g]);
      }
    }
  };
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row& row) {
    all += begin_[last + 1] - begin_[first];
    if (row.begin == own.begin) addRange(first, last);
  });
  const float enough = kOfSquareRoot * std::sqrt(static_cast<float>(all)) + 1.0f;
  const auto areSupported = [&] {
    const Group* const groups = groups_.data() + begin_[cell];
    return std::all_of(groups, groups + group_count_[cell], [&](const Group& group) {
      const std::size_t at = group.slice + kMargin;
      return !pass.asksFor(group) ||
             static_cast<float>(beams[at - 1] + beams[at] + beams[at + 1]) >= group.strictness * enough;
    });
  };
  if (areSupported()) return true;  // by their own row, as most are
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row& row) {
    if (row.begin != own.begin) addRange(first, last);
  });
  return areSupported();
}

std::array<int, 2> IsolatedPoints::slicesOf(std::uint32_t cell, const Pass& pass) const {
  std::array<int, 2> slices = {kSlices, 0};
  const Group* const groups = groups_.data() + begin_[cell];
  for (int g = 0; g < group_count_[cell]; ++g) {
    if (!pass.asksFor(groups[g])) continue;
    slices = {std::min<int>(slices[0], groups[g].slice), std::max<int>(slices[1], groups[g].slice)};
  }
  return slices;
}

bool IsolatedPoints::compareWithAllAndRow(std::uint32_t cell, const Pass& pass) {
  const auto [nearest, farthest] = slicesOf(cell, pass);
  const std::uint32_t own_row = cells_.rowOf(cell).begin;
  Profile all(nearest, farthest), strip(nearest, farthest);
  std::uint32_t beams = 0;
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row& row) {
    beams += begin_[last + 1] - begin_[first];
    for (std::uint32_t c = first; c <= last; ++c) {
      const Group* const others = groups_.data() + begin_[c];
      for (int g = 0; g < group_count_[c]; ++g) {
        if (!all.asksFor(others[g].slice)) continue;
        all.add(others[g].slice, others[g].beams, pass.supportOf(others[g]));
        if (row.begin == own_row) strip.add(others[g].slice, others[g].beams, pass.supportOf(others[g]));
      }
    }
  });
  if (beams <= kFewestAround) return false;
  all.accumulate();
  strip.accumulate();
  bool any = false;
  Group* const groups = groups_.data() + begin_[cell];
  for (int g = 0; g < group_count_[cell]; ++g) {
    Group& group = groups[g];
    if (!pass.asksFor(group)) continue;
    const float strictness = group.strictness;
    const float enough = strictness * std::max(kOfSquareRoot * std::sqrt(all.reaching(group.slice)), 1.0f);
    group.isolated_after = all.near(group.slice) < enough && !isLine(strip, group.slice, strictness);
    any |= group.isolated_after != 0;
  }
  return any;
}

void IsolatedPoints::compareWithColumns(std::uint32_t cell, const Pass& pass) {
  const auto [nearest, farthest] = slicesOf(cell, pass);
  const DirectionCells::Row own = cells_.rowOf(cell);
  const int own_column = static_cast<int>(cell - own.begin);
  Profile strips[2] = {{nearest, farthest}, {nearest, farthest}};  // of the two halves of the cell
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row& row) {
    const int halves = 2 * row.columns;
    // Of the two halves of the cell, those of the row at the same azimuth.
    const int same[2] = {(4 * own_column + 1) * row.columns / (2 * own.columns),
                         (4 * own_column + 3) * row.columns / (2 * own.columns)};
    for (std::uint32_t c = first; c <= last; ++c) {
      bool in_strip[2][2];  // by the half of this cell, and of the other
      for (int half = 0; half < 2; ++half) {
        for (int other = 0; other < 2; ++other) {
          const int apart = std::abs(2 * static_cast<int>(c - row.begin) + other - same[half]);
          in_strip[half][other] = std::min(apart, halves - apart) <= 1;
        }
      }
      const Group* const others = groups_.data() + begin_[c];
      for (int g = 0; g < group_count_[c]; ++g) {
        if (!strips[0].asksFor(others[g].slice)) continue;
        for (int half = 0; half < 2; ++half) {
          if (!in_strip[half][others[g].half]) continue;
          strips[half].add(others[g].slice, others[g].beams, pass.supportOf(others[g]));
        }
      }
    }
  });
  for (Profile& strip : strips) strip.accumulate();
  Group* const groups = groups_.data() + begin_[cell];
  for (int g = 0; g < group_count_[cell]; ++g) {
    if (pass.asksFor(groups[g]) && isLine(strips[groups[g].half], groups[g].slice, groups[g].strictness))
      groups[g].isolated_after = 0;
  }
}

bool IsolatedPoints::isClear(std::uint32_t cell, const Pass& pass, std::uint32_t isolated) const {
  // It is where enough beams end in the slices that all of its groups ask about, if there are any.
  const auto [nearest, farthest] = slicesOf(cell, {pass.last_slice, false});
  const int first_common = farthest - kNearer, last_common = nearest + kFarther;
  const DirectionCells::Row own = cells_.rowOf(cell);
  std::uint32_t ends = 0;
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row& row) {
    if (row.begin != own.begin) return;
    for (std::uint32_t c = first; c <= last; ++c) {
      const Group* const groups = groups_.data() + begin_[c];
      for (int g = 0; g < group_count_[c]; ++g) {
        if (groups[g].slice >= first_common && groups[g].slice <= last_common) ends += groups[g].beams;
      }
    }
  });
  return static_cast<float>(isolated) < kClear * static_cast<float>(ends);
}

bool IsolatedPoints::findStrictness(std::uint32_t cell, const Pass& pass) {
  // Sums over the slices before each, from -kNearer on.
  std::array<std::uint32_t, kSlices + kNearer + kBehind + 2> all, isolated;
  const auto [nearest, farthest] = slicesOf(cell, {pass.last_slice, false});
  const auto from = static_cast<std::size_t>(nearest),
             to = static_cast<std::size_t>(farthest) + kNearer + kBehind + 1;
  all.fill(0);
  isolated.fill(0);
  cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row&) {
    for (std::uint32_t c = first; c <= last; ++c) {
      const Group* const groups = groups_.data() + begin_[c];
      for (int g = 0; g < group_count_[c]; ++g) {
        const std::size_t at = std::clamp(std::size_t{groups[g].slice} + kNearer + 1, from, to + 1);
        all[at] += groups[g].beams;
        isolated[at] += groups[g].isolated ? groups[g].beams : 0;
      }
    }
  });
  for (std::size_t at = from; at < to; ++at) {
    all[at + 1] += all[at];
    isolated[at + 1] += isolated[at];
  }
  bool any = false;
  Group* const groups = groups_.data() + begin_[cell];
  for (int g = 0; g < group_count_[cell]; ++g) {
    if (groups[g].slice >= pass.last_slice) continue;
    const auto number = [s = std::size_t{groups[g].slice} + kNearer](const auto& sums, int first, int last) {
      return static_cast<float>(sums[s + static_cast<std::size_t>(last) + 1] -
                                sums[static_cast<std::size_t>(static_cast<int>(s) + first)]);
    };
    const float ends = number(all, -kNearer, kFarther), found = number(isolated, -kNearer, kFarther);
    const float elsewhere =
        3.0f * (number(isolated, -kNearer, kBehind) - number(isolated, -2, 2)) / (kNearer + kBehind - 4);
    const bool are_together = number(all, -1, 1) - 1.0f >= kTogether + kTimesElsewhere * elsewhere;
    const bool is_there = found < kClear * ends || are_together;
    groups[g].strictness = (is_there ? 0u : found > kThick * ends ? kInThick : 1u) & 3u;
    any |= groups[g].strictness != 0;
  }
  return any;
}

void IsolatedPoints::decide(std::uint32_t cell, const Pass& pass) {
  Group* const groups = groups_.data() + begin_[cell];
  Group* const end = groups + group_count_[cell];
  const auto isNear = [&](const Group& group) { return group.slice < pass.last_slice; };
  if (std::none_of(groups, end, isNear)) return;
  if (pass.second) {  // where no support is gone, the first pass has decided
    std::uint32_t isolated = 0;
    cells_.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row&) {
      for (std::uint32_t c = first; c <= last; ++c) isolated += isolated_in_[c];
    });
    if (isolated == 0) return;
    if (isClear(cell, pass, isolated)) {
      for (Group* group = groups; group != end; ++group) group->strictness = 0;
      return;
    }
    if (!findStrictness(cell, pass)) return;
  }
  if (std::none_of(groups, end, [&](const Group& group) { return pass.asksFor(group); })) return;
  if (areAllSupported(cell, pass)) return;
  if (compareWithAllAndRow(cell, pass)) compareWithColumns(cell, pass);
  if (pass.second) return;
  for (Group* group = groups; group != end; ++group) {
    group->isolated = group->isolated_after;
    if (group->isolated) isolated_in_[cell] += group->beams;
  }
}

void IsolatedPoints::markPoints(std::uint32_t cell) {
  const Group* const groups = groups_.data() + begin_[cell];
  for (int g = 0; g < group_count_[cell]; ++g) {
    if (groups[g].strictness == 0 || !groups[g].isolated_after) continue;
    for (std::uint32_t n = begin_[cell]; n < begin_[cell + 1]; ++n) {
      if (sorted_keys_[n] == keyOf(groups[g].half, groups[g].slice)) isolated_[point_of_[n]] = 1;
    }
  }
}

const std::vector<std::uint8_t>& IsolatedPoints::find(Span<const Eigen::Vector3f> points, float within,
                                                      ThreadPool& pool) {
  const int last_slice = sliceOf(within);
  sortIntoCells(points, std::min(last_slice + kFarther, kSlices - 1), pool);
  groups_.resize(point_of_.size());
  group_count_.resize(cells_.size());
  isolated_in_.assign(cells_.size(), 0);
  isolated_.assign(points.size(), 0);
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
  forEachCell([&](std::uint32_t cell) { decide(cell, {last_slice, false}); });
  forEachCell([&](std::uint32_t cell) { decide(cell, {last_slice, true}); });
  forEachCell([&](std::uint32_t cell) { markPoints(cell); });
  return isolated_;
}

}  // namespace bki_mapping
