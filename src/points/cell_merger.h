/// @file Merges the points of each down-sampling cell, one tile at a time.
#pragma once

#include <vector>

#include "parallel/thread_pool.h"
#include "points/merged_points.h"
#include "points/tile_grid.h"

namespace bki_mapping {

/// A point of a tile.
struct alignas(16) TilePoint {
  float x, y, z;       ///< relative to the sensor [m]
  std::uint16_t cell;  ///< offset of its cell in the tile
  ClassId label;
};

/// Sums the points of each cell, one tile at a time. Keeps its memory from tile to tile; one for each thread.
class alignas(kThreadsApart) CellMerger {
 public:
  /// Adds a point to its cell. @return the cell's position in the output of this tile if the point is the
  /// first of its cell, else kKnown.
  std::uint32_t add(const TilePoint& point) {
    std::uint16_t& slot = slots_[point.cell];
    if (slot == kEmpty) {
      slot = static_cast<std::uint16_t>(count_);
      return addAsCell(point);
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
  /// Adds a point as a cell of its own. @return the cell's position in the output of this tile.
  std::uint32_t addAsCell(const TilePoint& point) {
    Cell& cell = cells_[count_];
    cell.x = static_cast<double>(point.x);
    cell.y = static_cast<double>(point.y);
    cell.z = static_cast<double>(point.z);
    cell.count = cell.votes = 1;
    cell.more = kNoPosition;
    cell.offset = point.cell;
    cell.label = point.label;
    return count_++;
  }
  /// Starts a tile of at most `points` points.
  void startTile(std::size_t points) {
    if (cells_.size() < points) cells_.resize(points);
  }

  /// Appends one point for each cell, its centroid with the label of the majority (ties: the smaller id), in
  /// the order of the cells' first points. Then forgets the tile.
  void finishTile(MergedPoints& output);

  /// Allocates as much memory as `other` has, so that it does not depend on which thread gets which tile.
  void reserveAs(const CellMerger& other);

  static constexpr std::uint32_t kKnown = 0xffffffffu;

 private:
  static constexpr std::uint16_t kEmpty = 0xffff;
  static constexpr std::size_t kMostCells = TileGrid::kMostEdge * TileGrid::kMostEdge * TileGrid::kMostEdge;
  static_assert(kMostCells < kEmpty);

  struct Cell {
    double x, y, z;        ///< sums over the points
    std::uint32_t count;   ///< points
    std::uint32_t votes;   ///< points with `label`
    std::uint32_t more;    ///< head of the list of votes for other labels, or kNoPosition
    std::uint16_t offset;  ///< in the tile
    ClassId label;         ///< of the first point
  };
  /// The votes for one label of a cell: an element of a linked list in votes_.
  struct Votes {
    ClassId label;
    std::uint32_t count, next;
  };

  void voteForOther(Cell& cell, ClassId label);
  ClassId majority(const Cell& cell) const;

  /// Position in cells_ by a cell's offset in the tile, or kEmpty; one for every value of the offset's type.
  std::vector<std::uint16_t> slots_ = std::vector<std::uint16_t>(std::size_t{1} << 16, kEmpty);
  std::uint32_t count_ = 0;
  std::vector<Cell> cells_;  ///< the first count_ are in use
  std::vector<Votes> votes_;
};

}  // namespace bki_mapping
