/// @file Runs of items, brought together by the tile or block in which they lie.
#pragma once

#include <vector>

#include "parallel/group_by.h"
#include "parallel/index_numbering.h"

namespace bki_mapping {

/// Takes runs as several pieces of work have found them, and sorts them by their index. Keeps its memory when
/// cleared.
template <typename Run>
class RunsByIndex {
 public:
  void clear() {
    indices_.clear();
    added_.clear();
    number_.clear();
    begin_.assign(1, 0);
  }
  void add(const GridIndex& index, const Run& run) {
    // What comes one behind the other often lies together.
    const bool again = !number_.empty() && indices_.members()[number_.back()] == index;
    const std::uint32_t number = again ? number_.back() : indices_.insert(index);
    if (number + 1 == begin_.size()) begin_.push_back(0);
    ++begin_[number + 1];
    number_.push_back(number);
    added_.push_back(run);
  }
  /// Once all are added. Runs of one index stay in their order.
  void sort() {
    runs_.resize(added_.size());
    groupBy(indices_.size(), begin_.data(), [this](auto&& positionOf) {
      for (std::size_t r = 0; r < added_.size(); ++r) runs_[positionOf(number_[r])] = added_[r];
    });
  }

  /// In the order in which they were first seen.
  const IndexNumbering& indices() const { return indices_; }
  /// The runs of an index by its number in indices(); those of the next number follow.
  const Run* begin(std::size_t number) const { return runs_.data() + begin_[number]; }
  const Run* end(std::size_t number) const { return runs_.data() + begin_[number + 1]; }
  const Run* end() const { return runs_.data() + runs_.size(); }

 private:
  IndexNumbering indices_;
  std::vector<Run> added_;             ///< in the order in which they came
  std::vector<std::uint32_t> number_;  ///< of the index of each
  std::vector<std::uint32_t> begin_;   ///< of each index's runs; one more than indices
  std::vector<Run> runs_;              ///< sorted
};

}  // namespace bki_mapping
