/// @file Accounts for every cloud: received = integrated + dropped + waiting.
#pragma once

#include <bki_mapping/MappingStatus.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "core/quantile.h"
#include "core/unlisted_labels.h"

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

/// Why a cloud is not in the map.
enum class DropReason {
  kNoTransform,
  kTransformLate,
  kTooOld,
  kUnknownFrame,
  kBadTransform,
  kBadCloud,
  kEmpty,
  kQueueFull,
  kTooLarge,
  kMemory,
  kPaused,
  kTimeJump,
};

/// A reason's name, and its counter in the status.
struct DropKind {
  DropReason reason;
  const char* name;
  std::uint64_t MappingStatus::*count;
};
/// All reasons, in the order of the enumeration.
const std::vector<DropKind>& dropKinds();

/// Counts clouds and measures their times. Not thread-safe.
class ScanLedger {
 public:
  using Clock = RateMeter::Clock;

  void received(Clock::time_point now);
  /// @param latency from the reception of the cloud to the end of its integration [s].
  void integrated(const std_msgs::Header& header, const ScanStats& stats, double latency,
                  Clock::time_point now);
  /// @param why a sentence with the remedy.
  void dropped(const std_msgs::Header& header, DropReason reason, const std::string& why);
  /// Adds counts of labels that are not in the class table.
  void unlistedLabels(const UnlistedLabels& labels) { unknown_ += labels; }
  void timeJumped() { ++status_.time_jumps; }
  void tfJumped() { ++status_.tf_jumps; }

  std::uint64_t droppedClouds() const;
  const RollingStatistics& integration() const { return integration_; }  ///< [ms]

  /// The status, with the rates as of `now`. @param waiting number of clouds in the queue.
  MappingStatus status(Clock::time_point now, std::size_t waiting);
  /// The counts in one line, for the log.
  std::string summary(std::size_t waiting) const;

 private:
  MappingStatus status_;
  RollingStatistics latency_, integration_;
  RateMeter received_rate_, integrated_rate_;
  UnlistedLabels unknown_;
};

}  // namespace bki_mapping::ros_interface
