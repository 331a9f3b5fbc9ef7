/// @file Infers from the times of messages how long one has waited, and whether time jumped back.
#pragma once

#include <ros/time.h>

#include <algorithm>
#include <vector>

namespace bki_mapping::ros_interface {

enum class OnTimeJump { kKeep, kReset };

/// How long a message has waited for its callback [s of wall time], at most a minute. @param simulated
/// whether both times are of /clock. The result is then 0, because /clock does not measure waits: its first
/// step goes from 0 to the start of the replay, and a replay may be fast.
inline double secondsSince(const ros::Time& receipt, const ros::Time& now, bool simulated) {
  return simulated ? 0.0 : std::clamp(now.toSec() - receipt.toSec(), 0.0, 60.0);
}

/// Watches /clock and, for players without /clock, the stamps of each input.
class TimeWatch {
 public:
  /// A cloud may be this much older than the previous one without a time jump: out of order [s].
  static constexpr double kOutOfOrder = 1.0;
  /// Two consecutive clouds agree on the time if the second is at most this much newer [s].
  static constexpr double kLongestPause = 10.0;

  /// @return whether simulated time went back since the last call.
  bool clockWentBack() { return ros::Time::isSimTime() && clockWentBack(ros::Time::now()); }
  bool clockWentBack(const ros::Time& now) {
    const bool back = now < clock_;
    clock_ = now;
    return back;
  }

  /// @return whether two consecutive clouds of an input agree on a time that is more than kOutOfOrder before
  /// the latest time on which two clouds agreed. A single cloud with a wrong stamp, or a stamp of 0, does not
  /// count.
  bool stampsWentBack(std::size_t input, const ros::Time& stamp) {
    if (input >= inputs_.size()) inputs_.resize(input + 1);
    if (stamp.isZero()) return false;
    Input& i = inputs_[input];
    const double now = stamp.toSec(), before = i.last, latest = i.latest;
    i.last = now;
    if (now < before - kOutOfOrder || now > before + kLongestPause) return false;
    const bool back = std::max(before, now) < latest - kOutOfOrder;
    i.latest = back ? now : std::max(latest, before);
    return back;
  }

  /// Forgets all stamps.
  void restart() { inputs_.clear(); }

 private:
  /// Stamps of one input [s].
  struct Input {
    double last = 0.0;    ///< of the last cloud
    double latest = 0.0;  ///< latest stamp with which the next cloud agreed; 0: none yet
  };

  ros::Time clock_;
  std::vector<Input> inputs_;
};

}  // namespace bki_mapping::ros_interface
