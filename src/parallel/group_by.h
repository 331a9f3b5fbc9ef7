/// @file A stable counting sort, and runs of items that it groups by tile or block.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "parallel/index_numbering.h"

namespace bki_mapping {

/// Sorts items by an integer key in linear time; items with the same key keep their order.
/// @param begin array of `keys` + 1 elements. The caller sets begin[0] to 0 and begin[k + 1] to the number of
/// items with key k, which most callers count as they make the items. On return, the items with key k are at
/// positions begin[k] to begin[k + 1] - 1.
/// @param forEachItem called once as forEachItem(positionOf). It must call positionOf(key) for each item in
/// order, and move the item to the position returned.
template <typename ForEachItem>
void groupBy(std::size_t keys, std::uint32_t* begin, ForEachItem&& forEachItem) {
  for (std::size_t k = 1; k <= keys; ++k) begin[k] += begin[k - 1];
  forEachItem([begin](std::size_t key) { return begin[key]++; });
  // Each begin has advanced to that of the next key; shift them back.
  std::copy_backward(begin, begin + keys, begin + keys + 1);
  begin[0] = 0;
}

/// Collects runs of items from several pieces of work, and sorts the runs by grid index. Keeps its memory
/// when cleared.
template <typename Run>
class RunsByIndex {
 public:
  void clear() {
    indices_.clear();
    added_.clear();
    index_of_.clear();
    begin_.assign(1, 0);
  }
  void add(const GridIndex& index, const Run& run) {
    // Consecutive runs often have the same index.
    const bool again = !index_of_.empty() && indices_.members()[index_of_.back()] == index;
    const std::uint32_t position = again ? index_of_.back() : indices_.insert(index);
    if (position + 1 == begin_.size()) begin_.push_back(0);
    ++begin_[position + 1];
    index_of_.push_back(position);
    added_.push_back(run);
  }
  /// Call after the last add(). Runs with the same index keep their order.
  void sort() {
    runs_.resize(added_.size());
    groupBy(indices_.size(), begin_.data(), [this](auto&& positionOf) {
      for (std::size_t r = 0; r < added_.size(); ++r) runs_[positionOf(index_of_[r])] = added_[r];
    });
  }

  /// The indices of all runs, in the order in which they were first added.
  const IndexNumbering& indices() const { return indices_; }
  /// The runs of an index, given its position in indices(). Those of the next position follow in memory.
  const Run* begin(std::size_t index) const { return runs_.data() + begin_[index]; }
  const Run* end(std::size_t index) const { return runs_.data() + begin_[index + 1]; }
  const Run* end() const { return runs_.data() + runs_.size(); }

 private:
  IndexNumbering indices_;
  std::vector<Run> added_;               ///< in the order of add()
  std::vector<std::uint32_t> index_of_;  ///< of each run added: position in indices_
  std::vector<std::uint32_t> begin_;     ///< of each index's runs; one element more than indices_
  std::vector<Run> runs_;                ///< sorted
};

}  // namespace bki_mapping
