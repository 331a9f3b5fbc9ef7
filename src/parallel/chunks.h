/// @file How a scan's items are split for several threads: into the same pieces for any number of threads.
#pragma once

#include <algorithm>
#include <cstddef>

#include "parallel/thread_pool.h"

namespace bki_mapping {

/// Splits items 0 to n - 1 into consecutive chunks. The split depends on n alone.
class Chunks {
 public:
  static constexpr std::size_t kMost = 16;  ///< chunks; enough to keep cores busy, few enough to merge

  explicit Chunks(std::size_t items)
      : items_(items), length_(std::max<std::size_t>(256, (items + kMost - 1) / kMost)) {}

  std::size_t count() const { return (items_ + length_ - 1) / length_; }
  std::size_t begin(std::size_t chunk) const { return chunk * length_; }
  std::size_t end(std::size_t chunk) const { return std::min(items_, (chunk + 1) * length_); }

 private:
  std::size_t items_, length_;
};

}  // namespace bki_mapping
