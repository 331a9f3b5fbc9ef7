/// @file Orders blocks by group.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "map/block_group.h"
#include "parallel/index_numbering.h"

namespace bki_mapping {

/// Orders blocks by group, and finds them by slot. Keeps its memory when cleared.
class BlocksByGroup {
 public:
  void clear() {
    groups_.clear();
    members_.clear();
    numbers_.clear();
    size_ = 0;
  }
  /// Inserts a block unless it is a member. Must not be called after sort().
  /// @return its number: 0, 1, 2, ... in the order of insertion.
  std::uint32_t insert(const BlockIndex& block) {
    const std::uint32_t group = groups_.insert(groupOf(block));
    if (group == members_.size()) members_.emplace_back();
    Members& members = members_[group];
    const int slot = slotInGroup(block);
    std::uint32_t& number = members.at[static_cast<std::size_t>(slot)];
    if ((members.slots >> slot & 1) == 0) {
      members.slots |= std::uint64_t{1} << slot;
      number = size_++;
    }
    return number;
  }
  /// Call after the last insert(). Numbers the blocks 0, 1, 2, ... in the order of their groups, and within a
  /// group by rising slots, so that each comes after the block below it in the group.
  void sort() {
    for (Members& members : members_) {
      members.begin = numbers_.size();
      for (std::uint64_t left = members.slots; left != 0; left &= left - 1) {
        std::uint32_t& at = members.at[static_cast<std::size_t>(__builtin_ctzll(left))];
        numbers_.push_back(at);
        at = static_cast<std::uint32_t>(numbers_.size() - 1);
      }
      members.end = numbers_.size();
    }
  }

  /// The groups, in the order in which their first blocks were inserted.
  const IndexNumbering& groups() const { return groups_; }
  /// The numbers that insert() gave, in the new order.
  const std::vector<std::uint32_t>& numbers() const { return numbers_; }
  /// The slots of a group's blocks. @param group position in groups().
  std::uint64_t slots(std::size_t group) const { return members_[group].slots; }
  /// The positions of a group's blocks in the new order: `begin` to `end` - 1.
  std::size_t begin(std::size_t group) const { return members_[group].begin; }
  std::size_t end(std::size_t group) const { return members_[group].end; }
  /// The position of the block in a slot, or kNoPosition.
  std::uint32_t at(std::size_t group, int slot) const {
    const Members& members = members_[group];
    return (members.slots >> slot & 1) != 0 ? members.at[static_cast<std::size_t>(slot)] : kNoPosition;
  }

 private:
  struct Members {
    std::uint64_t slots = 0;
    std::size_t begin = 0, end = 0;
    std::array<std::uint32_t, kGroupBlocks> at;  ///< by slot: numbers, then positions; valid at `slots`
  };

  IndexNumbering groups_;
  std::vector<Members> members_;  ///< in the order of groups_
  std::vector<std::uint32_t> numbers_;
  std::uint32_t size_ = 0;
};

}  // namespace bki_mapping
