/// @file Where a thread with less urgent work waits.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace bki_mapping {

/// One thread closes and opens it; another passes it now and then, and waits while it is closed.
class Gate {
 public:
  /// That long the other thread waits at most, less what it has run since: it cannot starve.
  static constexpr auto kMostWait = std::chrono::milliseconds(100);
  /// When it has waited for that long, it runs for this long, closed or not.
  static constexpr auto kLeastRun = std::chrono::milliseconds(25);

  /// Closes a gate for its own lifetime. @param gate nullptr: none.
  class Closed {
   public:
    explicit Closed(Gate* gate);
    ~Closed();
    Closed(const Closed&) = delete;
    Closed& operator=(const Closed&) = delete;

   private:
    Gate* gate_;
  };

  /// Waits while the gate is closed, as long as the thread's patience lasts.
  void pass();

 private:
  using Clock = std::chrono::steady_clock;

  void set(bool closed);

  std::atomic<bool> closed_{false};
  std::mutex mutex_;
  std::condition_variable opened_;
  // Of the thread that passes:
  Clock::duration patience_ = kMostWait;  ///< time for which it would wait
  bool is_impatient_ = false;             ///< it has waited for long enough
  Clock::time_point passed_ = Clock::now();
};

}  // namespace bki_mapping
