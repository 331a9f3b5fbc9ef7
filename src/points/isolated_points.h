/// @file Finds the points of a scan near which few other beams end: drops, flakes, fog and dust.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "bki_mapping/core/types.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// The directions into which beams are sorted. Cells are about a degree high and wide; their rows have equal
/// heights in the sine of the elevation.
class DirectionCells {
 public:
  DirectionCells();

  std::uint32_t size() const { return begin_.back(); }
  /// A cell, and the half of it that a direction is in: 0 or 1, by rising azimuth.
  struct Place {
    std::uint32_t cell;
    std::uint8_t half;
  };
  /// The place of a direction. @param row from the south pole, with fractions. @param turn azimuth as a part
  /// of the full turn, from 0 to 1.
  Place placeOf(float row, float turn) const {
    const auto r = static_cast<std::size_t>(std::clamp(static_cast<int>(row), 0, kRows - 1));
    const float column = turn * columns_[r];
    const int last = static_cast<int>(columns_[r]) - 1, whole = std::min(static_cast<int>(column), last);
    return {begin_[r] + static_cast<std::uint32_t>(whole),
            column - static_cast<float>(whole) < 0.5f ? std::uint8_t{0} : std::uint8_t{1}};
  }
  /// @param point of any length > 0.
  Place placeOf(const Eigen::Vector3f& point, float length) const;

  /// A row of cells.
  struct Row {
    std::uint32_t begin;  ///< its first cell
    int columns;
  };
  Row rowOf(std::uint32_t cell) const {
    const std::size_t row = row_of_[cell];
    return {begin_[row], static_cast<int>(begin_[row + 1] - begin_[row])};
  }
  /// Calls visit(first, last, row) for ranges of cells of a row which together are the cells up to kReach
  /// rows and columns away from a cell, itself among them, each once.
  template <typename Visit>
  void visitAround(std::uint32_t cell, Visit&& visit) const {
    const Row own = rowOf(cell);
    const int column = static_cast<int>(cell - own.begin), middle_row = row_of_[cell];
    for (int r = std::max(middle_row - kReach, 0); r <= std::min(middle_row + kReach, kRows - 1); ++r) {
      const Row row = rowOf(begin_[static_cast<std::size_t>(r)]);
      const int n = row.columns, middle = (2 * column + 1) * n / (2 * own.columns);
      const int low = middle - kReach, high = middle + kReach;
      const auto visitColumns = [&](int first, int last) {
        visit(row.begin + static_cast<std::uint32_t>(first), row.begin + static_cast<std::uint32_t>(last),
              row);
      };
      if (n <= 2 * kReach + 1) {
        visitColumns(0, n - 1);
        continue;
      }
      visitColumns(std::max(low, 0), std::min(high, n - 1));
      if (low < 0) visitColumns(low + n, n - 1);
      if (high >= n) visitColumns(0, high - n);
    }
  }

  /// Rows of lidars with 16 of them are 2 degrees apart: two cells.
  static constexpr int kReach = 2;
  static constexpr int kRows = 116;

 private:
  std::array<std::uint32_t, kRows + 1> begin_ = {};  ///< the first cell of each row, and their number
  std::array<float, kRows> columns_ = {};            ///< number of cells of each row
  std::vector<std::uint8_t> row_of_;                 ///< of each cell
};

/// Finds isolated points, Equations 3b and 3c in docs/method.md. The result depends on the set of the points
/// alone. Keeps its memory from scan to scan.
class IsolatedPoints {
 public:
  /// @param points relative to the sensor [m]; those that are not finite, or at the sensor, are no beams.
  /// @param within points in the slice of this range, or farther away, are not isolated; at most kFarthest
  /// [m].
  /// @return for each point, whether it is isolated; valid until the next call.
  const std::vector<std::uint8_t>& find(Span<const Eigen::Vector3f> points, float within, ThreadPool& pool);

  /// Slices of depth: as thick as a 64th to a 128th of the range plus 2 m, so that the noise of a lidar is
  /// less than one. The last one is all that is farther than kFarthest.
  static constexpr int kSlices = 256;
  static int sliceOf(float range);
  static constexpr float kFarthest = 30.0f;  ///< [m]

  /// A line through n beams side by side meets about sqrt(n) of them: so many must end near a point.
  static constexpr float kOfSquareRoot = 1.0f;
  /// Or this part, and at least so many, of the beams in a strip: those of the same row of cells, or, in all
  /// rows, those up to one half of a column away.
  static constexpr float kOfStrip = 0.15f, kLeastOfStrip = 3.0f;
  /// With fewer beams around, whatever their range, nothing is isolated.
  static constexpr std::uint32_t kFewestAround = 3;

  /// The second pass asks how many of the beams that end about there or nearer, in the slices from so many
  /// before to so many behind that of the point, the first one found isolated.
  static constexpr int kNearer = 40, kFarther = 2;
  static constexpr float kClear = 0.15f;  ///< if it is a smaller part, nothing is isolated after all
  static constexpr float kThick = 0.3f;   ///< if it is a larger one, `kInThick` times as many must end near
  static constexpr std::uint8_t kInThick = 3;
  static_assert(kInThick <= 3, "Group::strictness has two bits");
  /// Nor is a point isolated if so many others end near it, isolated ones among them, and besides
  /// `kTimesElsewhere` times as many as of the isolated ones in as many slices elsewhere, on average: those
  /// from kNearer before to kBehind behind its own, but for the two on either side. Slanted wires are such
  /// points.
  static constexpr float kTogether = 4.0f, kTimesElsewhere = 6.0f;
  static constexpr int kBehind = 20;

 private:
  /// The beams of half a cell that end in the same slice.
  struct Group {
    std::uint8_t half, slice;
    std::uint8_t isolated;            ///< after the first pass; other threads read it during the second
    std::uint8_t isolated_after : 1;  ///< in either pass, which says nothing where the strictness is 0
    std::uint8_t strictness : 2;      ///< what must end near it, as a multiple
    std::uint32_t beams;
  };
  /// The half of its cell and the slice of a beam: those of a Group.
  static std::uint16_t keyOf(std::uint8_t half, int slice) {
    return static_cast<std::uint16_t>(half * kSlices + slice);
  }
  /// Finds cells and keys. Slices from `farthest` on are one, since nothing asks how far such beams reach.
  void findPlaces(const Eigen::Vector3f* points, std::size_t count, int farthest, std::uint32_t* cells,
                  std::uint16_t* keys) const;
  void sortIntoCells(Span<const Eigen::Vector3f> points, int farthest, ThreadPool& pool);
  void makeGroups(std::uint32_t cell);
  /// The first pass asks for the support of all groups; the second one for that of those that are not
  /// isolated after the first, by those that are not.
  struct Pass {
    int last_slice;  ///< groups from it on are not isolated
    bool second;
    bool asksFor(const Group& group) const { return group.slice < last_slice && !(second && group.isolated); }
    std::uint32_t supportOf(const Group& group) const { return second && group.isolated ? 0 : group.beams; }
  };
  /// Sets the strictness of the second pass. @return whether that of any group is above 0.
  bool findStrictness(std::uint32_t cell, const Pass& pass);
  /// Whether the beams of its row alone show that nothing in a cell is isolated after all.
  /// @param isolated number of beams around that the first pass found.
  bool isClear(std::uint32_t cell, const Pass& pass, std::uint32_t isolated) const;
  /// Decides about the groups of a cell.
  void decide(std::uint32_t cell, const Pass& pass);
  // Parts of decide(), by what they take: the first one decides about most cells.
  /// Whether so many beams end near each group of a cell that nothing else matters.
  bool areAllSupported(std::uint32_t cell, const Pass& pass) const;
  /// Finds the groups of a cell that neither all beams around nor those of its row support.
  /// @return whether there are any.
  bool compareWithAllAndRow(std::uint32_t cell, const Pass& pass);
  /// Of these, keeps those that the beams of their column do not support either.
  void compareWithColumns(std::uint32_t cell, const Pass& pass);
  /// The first and the last slice of the groups of a cell for which a pass asks, of which there is one.
  std::array<int, 2> slicesOf(std::uint32_t cell, const Pass& pass) const;
  void markPoints(std::uint32_t cell);

  DirectionCells cells_;
  std::vector<std::uint32_t> cell_of_;      ///< of each point
  std::vector<std::uint16_t> key_of_;       ///< of each point
  std::vector<std::uint32_t> begin_;        ///< position of the first beam, and group, of each cell
  std::vector<std::uint32_t> point_of_;     ///< of each beam, by cell
  std::vector<std::uint16_t> sorted_keys_;  ///< of each beam, by cell
  std::vector<Group> groups_;               ///< of each cell, from its `begin_` on
  std::vector<std::uint16_t> group_count_;  ///< of each cell
  std::vector<std::uint32_t> isolated_in_;  ///< beams of each cell that the first pass found
  std::vector<std::uint8_t> isolated_;      ///< of each point
};

}  // namespace bki_mapping
