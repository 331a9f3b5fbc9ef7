/// @file Merges the points of the cells of one tile.
#pragma once

#include <vector>

#include "parallel/thread_pool.h"
#include "points/tile_grid.h"

namespace bki_mapping {

/// A point of a tile.
struct alignas(16) TilePoint {
  float x, y, z;       ///< relative to the sensor [m]
  std::uint16_t cell;  ///< in the tile
  ClassId label;
};

/// Points with a class each, axis by axis.
struct MergedPoints {
  std::vector<float> x, y, z;  ///< relative to the sensor [m]
  std::vector<ClassId> labels;

  std::size_t size() const { return labels.size(); }
  void resize(std::size_t size) {
    x.resize(size);
    y.resize(size);
    z.resize(size);
    labels.resize(size);
  }
};

/// Adds up points cell by cell, one tile at a time. Keeps its memory from tile to tile. Each thread has its
/// own.
class alignas(kThreadsApart) CellMerger {
 public:
  /// @return the place of the cell among those of this tile, in the order of their first points; kKnown if
  /// the point is not its cell's first.
  std::uint32_t add(const TilePoint& point) {
    std::uint16_t& slot = slots_[point.cell];
    if (slot == kEmpty) {
      slot = static_cast<std::uint16_t>(count_);
      return addAlone(point);
    }
    Cell& cell = cells_[slot];
    cell.x += static_cast<double>(point.x);
    cell.y += static_cast<double>(point.y);
    cell.z += static_cast<double>(point.z);
    ++cell.count;
    if (point.label == cell.label) {
      ++cell.votes;
    } else {
      voteForOther(cell, point.label);
    }
    return kKnown;
  }
  /// Adds a point that is a cell of its own. @return as add.
  std::uint32_t addAlone(const TilePoint& point) {
    Cell& cell = cells_[count_];
    cell.x = static_cast<double>(point.x);
    cell.y = static_cast<double>(point.y);
    cell.z = static_cast<double>(point.z);
    cell.count = cell.votes = 1;
    cell.more = kNone;
    cell.place = point.cell;
    cell.label = point.label;
    return count_++;
  }
  /// Provides for a tile of so many points.
  void startTile(std::size_t points) {
    if (cells_.size() < points) cells_.resize(points);
  }

  /// Appends one point a cell, the centroid with the label of most (ties: the smaller id), in the order of
  /// their first points; then forgets them.
  void finishTile(MergedPoints& output);

  /// Provides for as many cells as `other` does, so that memory does not depend on who gets which tile.
  void reserveAs(const CellMerger& other);

  static constexpr std::uint32_t kKnown = 0xffffffffu;

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  static constexpr std::uint16_t kEmpty = 0xffff;
  static constexpr std::size_t kMostCells = TileGrid::kMostEdge * TileGrid::kMostEdge * TileGrid::kMostEdge;
  static_assert(kMostCells < kEmpty);

  struct Cell {
    double x, y, z;  ///< sums
    std::uint32_t count;
    std::uint32_t votes;  ///< for `label`
    std::uint32_t more;   ///< first of the votes for other labels
    std::uint16_t place;  ///< in the tile
    ClassId label;
  };
  struct Votes {
    ClassId label;
    std::uint32_t count, next;
  };

  void voteForOther(Cell& cell, ClassId label);
  ClassId majority(const Cell& cell) const;

  /// Cells by place; one for each number that a place can be.
  std::vector<std::uint16_t> slots_ = std::vector<std::uint16_t>(std::size_t{1} << 16, kEmpty);
  std::uint32_t count_ = 0;
  std::vector<Cell> cells_;  ///< `count_` of them
  std::vector<Votes> votes_;
};

}  // namespace bki_mapping
