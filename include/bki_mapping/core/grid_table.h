/// @file A hash table from grid indices to numbers.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// Maps grid indices to numbers: open addressing with linear probing, at most half full. Keeps its memory
/// when cleared.
class GridTable {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// @return the number of an index, or kNone.
  std::uint32_t find(const GridIndex& index) const {
    return slots_.empty() ? kNone : slots_[slotOf(index)].number;
  }
  /// Gives an index its number unless it has one. @param number not kNone. @return the number it has now.
  std::uint32_t insert(const GridIndex& index, std::uint32_t number) {
    if (2 * (size_ + 1) > slots_.size()) grow();
    Slot& slot = slots_[slotOf(index)];
    if (slot.number == kNone) {
      slot = {index, number};
      ++size_;
    }
    return slot.number;
  }
  /// Changes the number of an index that is in the table.
  void set(const GridIndex& index, std::uint32_t number) { slots_[slotOf(index)].number = number; }

  void erase(const GridIndex& index) {
    if (slots_.empty() || slots_[slotOf(index)].number == kNone) return;
    std::size_t hole = slotOf(index);
    // Members behind the hole that were pushed past it move up (Knuth, TAOCP 3, algorithm 6.4 R).
    for (std::size_t s = next(hole); slots_[s].number != kNone; s = next(s)) {
      const std::size_t home = GridIndexHash()(slots_[s].index) & mask();
      if (((s - home) & mask()) >= ((s - hole) & mask())) {
        slots_[hole] = slots_[s];
        hole = s;
      }
    }
    slots_[hole].number = kNone;
    --size_;
  }

  void clear() {
    slots_.assign(slots_.size(), Slot{});
    size_ = 0;
  }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    GridIndex index;
    std::uint32_t number = kNone;
  };

  std::size_t mask() const { return slots_.size() - 1; }
  std::size_t next(std::size_t slot) const { return (slot + 1) & mask(); }
  /// Where an index is, or would be put.
  std::size_t slotOf(const GridIndex& index) const {
    std::size_t slot = GridIndexHash()(index) & mask();
    while (slots_[slot].number != kNone && slots_[slot].index != index) slot = next(slot);
    return slot;
  }
  void grow() {
    std::vector<Slot> old(slots_.empty() ? 64 : 2 * slots_.size());
    slots_.swap(old);
    for (const Slot& slot : old) {
      if (slot.number != kNone) slots_[slotOf(slot.index)] = slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t size_ = 0;
};

}  // namespace bki_mapping
