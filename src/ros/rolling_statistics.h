/// @file Statistics of the last values of a series.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <deque>
#include <vector>

namespace bki_mapping::ros_shell {

/// Quantiles of the last values.
class RollingStatistics {
 public:
  explicit RollingStatistics(std::size_t most = 200) : most_(most) {}

  void add(double value) {
    values_.push_back(value);
    if (values_.size() > most_) values_.pop_front();
  }
  std::size_t size() const { return values_.size(); }

  /// The smallest value that at least a share `q` of the values does not exceed; 0 if there are none.
  double quantile(double q) const {
    if (values_.empty()) return 0.0;
    std::vector<double> sorted(values_.begin(), values_.end());
    const double rank = std::ceil(q * static_cast<double>(sorted.size()));
    const auto place = static_cast<std::ptrdiff_t>(std::max(rank, 1.0)) - 1;
    std::nth_element(sorted.begin(), sorted.begin() + place, sorted.end());
    return sorted[static_cast<std::size_t>(place)];
  }
  double median() const { return quantile(0.5); }

 private:
  std::size_t most_;
  std::deque<double> values_;
};

/// How often something happened in the last seconds.
class RateMeter {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param window length of the time looked back on [s].
  explicit RateMeter(double window = 5.0) : window_(window) {}

  void tick(Clock::time_point now) {
    if (!started_) first_ = now;
    started_ = true;
    times_.push_back(now);
    forget(now);
  }
  /// Events a second [Hz]; counts from the first event while the window is not full yet.
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

}  // namespace bki_mapping::ros_shell
