/// @file Soft labels: the probabilities of several classes for each point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// The probability of one class for a point.
struct ClassShare {
  ClassId id;
  float share;  ///< probability, > 0
};

/// The shares of the classes for each point of a scan. Those of a point sum to 1, or it has none.
class SoftLabels {
 public:
  bool empty() const { return begin_.empty(); }  ///< whether there are no points
  std::size_t size() const { return begin_.size(); }

  void clear() {
    begin_.clear();
    shares_.clear();
  }
  /// Starts a new point.
  void startPoint() { begin_.push_back(shares_.size()); }
  /// Adds a class to the last point.
  void add(const ClassShare& share) { shares_.push_back(share); }

  const ClassShare* begin(std::size_t point) const { return shares_.data() + begin_[point]; }
  const ClassShare* end(std::size_t point) const {
    return shares_.data() + (point + 1 < begin_.size() ? begin_[point + 1] : shares_.size());
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<ClassShare> shares_;
};

}  // namespace bki_mapping
