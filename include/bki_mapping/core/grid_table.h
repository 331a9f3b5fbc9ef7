/// @file A hash table from grid indices to positions in an array.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// Maps grid indices to positions by open addressing with linear probing; at most half full. Keeps its memory
/// when cleared.
class GridTable {
 public:
  /// @return the position of an index, or kNoPosition.
  std::uint32_t find(const GridIndex& index) const {
    return slots_.empty() ? kNoPosition : slots_[slotOf(index)].position;
  }
  /// Inserts an index with its position unless it is present. @param position not kNoPosition.
  /// @return the position that the table now has for the index.
  std::uint32_t insert(const GridIndex& index, std::uint32_t position) {
    if (2 * (size_ + 1) > slots_.size()) grow();
    Slot& slot = slots_[slotOf(index)];
    if (slot.position == kNoPosition) {
      slot = {index, position};
      ++size_;
    }
    return slot.position;
  }
  /// Changes the position of an index that is in the table.
  void set(const GridIndex& index, std::uint32_t position) { slots_[slotOf(index)].position = position; }

  void erase(const GridIndex& index) {
    if (slots_.empty() || slots_[slotOf(index)].position == kNoPosition) return;
    std::size_t hole = slotOf(index);
    // Move later entries back so that no probe sequence meets a hole (Knuth, TAOCP 3, algorithm 6.4 R).
    for (std::size_t s = next(hole); slots_[s].position != kNoPosition; s = next(s)) {
      const std::size_t preferred = GridIndexHash()(slots_[s].index) & mask();
      if (((s - preferred) & mask()) >= ((s - hole) & mask())) {
        slots_[hole] = slots_[s];
        hole = s;
      }
    }
    slots_[hole].position = kNoPosition;
    --size_;
  }

  /// Allocates memory for a number of indices in all, so that inserting them allocates nothing.
  void reserve(std::size_t size) {
    while (2 * size > slots_.size()) grow();
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
    std::uint32_t position = kNoPosition;
  };

  std::size_t mask() const { return slots_.size() - 1; }
  std::size_t next(std::size_t slot) const { return (slot + 1) & mask(); }
  /// The slot that holds an index, or the free slot that would.
  std::size_t slotOf(const GridIndex& index) const {
    std::size_t slot = GridIndexHash()(index) & mask();
    while (slots_[slot].position != kNoPosition && slots_[slot].index != index) slot = next(slot);
    return slot;
  }
  void grow() {
    std::vector<Slot> old(slots_.empty() ? 64 : 2 * slots_.size());
    slots_.swap(old);
    for (const Slot& slot : old) {
      if (slot.position != kNoPosition) slots_[slotOf(slot.index)] = slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t size_ = 0;
};

}  // namespace bki_mapping
