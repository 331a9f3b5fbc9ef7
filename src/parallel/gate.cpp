#include "parallel/gate.h"

#include <algorithm>

namespace bki_mapping {

Gate::Closed::Closed(Gate* gate) : gate_(gate) {
  if (gate_ != nullptr) gate_->set(true);
}

Gate::Closed::~Closed() {
  if (gate_ != nullptr) gate_->set(false);
}

void Gate::set(bool closed) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = closed;
  }
  opened_.notify_all();
}

void Gate::pass() {
  const auto now = Clock::now();
  patience_ = std::min<Clock::duration>(kMostWait, patience_ + (now - passed_));
  if (patience_ >= kLeastRun) is_impatient_ = false;
  passed_ = now;
  if (!closed_ || is_impatient_) return;
  std::unique_lock<std::mutex> lock(mutex_);
  opened_.wait_for(lock, patience_, [this] { return !closed_; });
  passed_ = Clock::now();
  patience_ = std::max(Clock::duration::zero(), patience_ - (passed_ - now));
  is_impatient_ = patience_ == Clock::duration::zero();
}

}  // namespace bki_mapping
