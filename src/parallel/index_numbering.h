/// @file Numbers cells or blocks in the order in which they are first seen.
#pragma once

#include <vector>

#include "bki_mapping/core/grid_table.h"

namespace bki_mapping {

/// A set of grid indices that numbers its members 0, 1, 2, ... Keeps its memory when cleared.
class IndexNumbering {
 public:
  static constexpr std::uint32_t kNone = GridTable::kNone;

  /// @return the index's number, a new one if it was not yet a member.
  std::uint32_t insert(const GridIndex& index) {
    const std::uint32_t number = table_.insert(index, static_cast<std::uint32_t>(members_.size()));
    if (number == members_.size()) members_.push_back(index);
    return number;
  }
  /// @return the index's number, or kNone.
  std::uint32_t find(const GridIndex& index) const { return table_.find(index); }
  /// The members; each stands at its number.
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
