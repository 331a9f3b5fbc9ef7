/// @file Something done in order with pieces that several threads finish in any order.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

namespace bki_mapping {

/// Whoever finishes a piece of work takes it in turn, if all before it have been taken, and with it those
/// behind it that wait. So what must go in order is done while others are still at work.
class OrderedQueue {
 public:
  /// Before each piece is finished once. Allocates no memory for no more pieces than ever before.
  void start(std::size_t pieces) {
    finished_.assign(pieces, false);
    next_ = 0;
  }
  /// Calls take(piece) for this piece and others, one at a time and in order, as soon as may be; once all are
  /// finished, all are taken. Called from any thread.
  template <typename Take>
  void finish(std::size_t piece, Take&& take) {
    const std::lock_guard<std::mutex> lock(*mutex_);
    finished_[piece] = true;
    for (; next_ < finished_.size() && finished_[next_]; ++next_) take(next_);
  }

 private:
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // one does not move
  std::vector<bool> finished_;
  std::size_t next_ = 0;  ///< first piece not yet taken
};

}  // namespace bki_mapping
