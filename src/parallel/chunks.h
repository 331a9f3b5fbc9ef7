/// @file Splits the items of a scan into chunks for several threads.
#pragma once

#include <algorithm>
#include <cstddef>

#include "parallel/thread_pool.h"

namespace bki_mapping {

/// Splits items 0 to n - 1 into consecutive chunks. The split depends only on n, so that results do not
/// depend on the number of threads.
class Chunks {
 public:
  static constexpr std::size_t kMost = 16;  ///< enough chunks to keep cores busy, few enough to merge cheaply

  explicit Chunks(std::size_t items)
      : items_(items), length_(std::max<std::size_t>(256, (items + kMost - 1) / kMost)) {}

  std::size_t count() const { return (items_ + length_ - 1) / length_; }
  std::size_t begin(std::size_t chunk) const { return chunk * length_; }
  std::size_t end(std::size_t chunk) const { return std::min(items_, (chunk + 1) * length_); }

 private:
  std::size_t items_, length_;
};

}  // namespace bki_mapping
