/// @file Numbers cells or blocks in the order in which they are first seen.
#pragma once

#include <cstdint>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// A set of grid indices that numbers its members 0, 1, 2, ... An open-addressing hash table.
class IndexNumbering {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// @return the index's number, a new one if it was not yet a member.
  std::uint32_t insert(const GridIndex& index) {
    if (2 * (members_.size() + 1) > slots_.size()) grow();
    std::uint32_t& slot = slots_[slotOf(index)];
    if (slot == kNone) {
      slot = static_cast<std::uint32_t>(members_.size());
      members_.push_back(index);
    }
    return slot;
  }
  /// @return the index's number, or kNone.
  std::uint32_t find(const GridIndex& index) const { return slots_.empty() ? kNone : slots_[slotOf(index)]; }
  /// The members; each stands at its number.
  const std::vector<GridIndex>& members() const { return members_; }
  std::size_t size() const { return members_.size(); }

 private:
  std::size_t slotOf(const GridIndex& index) const {
    std::size_t slot = GridIndexHash()(index) & (slots_.size() - 1);
    while (slots_[slot] != kNone && members_[slots_[slot]] != index) slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }
  void grow() {
    slots_.assign(slots_.empty() ? 1024 : 2 * slots_.size(), kNone);
    for (std::uint32_t n = 0; n < members_.size(); ++n) slots_[slotOf(members_[n])] = n;
  }

  std::vector<GridIndex> members_;
  std::vector<std::uint32_t> slots_;
};

}  // namespace bki_mapping
