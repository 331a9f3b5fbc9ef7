/// @file A set of cells or blocks that remembers the order of insertion.
#pragma once

#include <vector>

#include "bki_mapping/core/grid_table.h"

namespace bki_mapping {

/// A set of grid indices, numbered 0, 1, 2, ... in the order of insertion. Keeps its memory when cleared.
class IndexNumbering {
 public:
  /// Inserts an index unless it is a member. @return its position in members().
  std::uint32_t insert(const GridIndex& index) {
    const std::uint32_t position = table_.insert(index, static_cast<std::uint32_t>(members_.size()));
    if (position == members_.size()) members_.push_back(index);
    return position;
  }
  /// @return the index's position in members(), or kNoPosition.
  std::uint32_t find(const GridIndex& index) const { return table_.find(index); }
  /// The members in the order of insertion.
  const std::vector<GridIndex>& members() const { return members_; }
  std::size_t size() const { return members_.size(); }
  void clear() {
    table_.clear();
    members_.clear();
  }

 private:
  GridTable table_;
  std::vector<GridIndex> members_;
};

}  // namespace bki_mapping
