/// @file Statistics over the recent past: quantiles of values, and rates of events.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <deque>

#include "core/quantile.h"

namespace bki_mapping::ros_interface {

/// Quantiles of the last `max_size` values.
class RollingStatistics {
 public:
  explicit RollingStatistics(std::size_t max_size = 200) : max_size_(max_size) {}

  void add(double value) {
    values_.push_back(value);
    if (values_.size() > max_size_) values_.pop_front();
  }
  std::size_t size() const { return values_.size(); }

  /// 0 if there are no values.
  double quantile(double p) const { return bki_mapping::quantile({values_.begin(), values_.end()}, p); }
  double median() const { return quantile(0.5); }

 private:
  std::size_t max_size_;
  std::deque<double> values_;
};

/// The rate of events over a sliding time window.
class RateMeter {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param window length of the window [s].
  explicit RateMeter(double window = 5.0) : window_(window) {}

  void tick(Clock::time_point now) {
    if (!started_) first_ = now;
    started_ = true;
    times_.push_back(now);
    forget(now);
  }
  /// Events per second [Hz]; until the window is full, averaged over the time since the first event.
  double rate(Clock::time_point now) {
    forget(now);
    if (times_.empty()) return 0.0;
    const double since_first = std::chrono::duration<double>(now - first_).count();
    return static_cast<double>(times_.size()) / std::clamp(since_first, 1.0, window_);
  }

 private:
  void forget(Clock::time_point now) {
    while (!times_.empty() && std::chrono::duration<double>(now - times_.front()).count() > window_) {
      times_.pop_front();
    }
  }

  double window_;
  bool started_ = false;
  Clock::time_point first_;
  std::deque<Clock::time_point> times_;
};

}  // namespace bki_mapping::ros_interface
