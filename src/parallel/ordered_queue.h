/// @file Processes in order what several threads finish in any order.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

namespace bki_mapping {

/// An ordered commit queue. Threads finish pieces of work in any order; the thread that finishes a piece also
/// takes it, and those waiting after it, as soon as all earlier pieces have been taken. So the ordered step
/// overlaps with the work of the other threads.
class OrderedQueue {
 public:
  /// Resets the queue for `pieces` pieces. Allocates only if there are more than ever before.
  void start(std::size_t pieces) {
    finished_.assign(pieces, false);
    next_ = 0;
  }
  /// Marks a piece as finished, and calls take(p) for each piece that is now ready, one at a time and in
  /// order. Call it once for each piece, from any thread.
  template <typename Take>
  void finish(std::size_t piece, Take&& take) {
    const std::lock_guard<std::mutex> lock(*mutex_);
    finished_[piece] = true;
    for (; next_ < finished_.size() && finished_[next_]; ++next_) take(next_);
  }

 private:
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // a mutex cannot be moved
  std::vector<bool> finished_;
  std::size_t next_ = 0;  ///< first piece not yet taken
};

}  // namespace bki_mapping
