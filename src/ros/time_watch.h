/// @file Notices when time jumps back.
#pragma once

#include <ros/time.h>

#include <algorithm>
#include <vector>

namespace bki_mapping::ros_shell {

enum class OnTimeJump { kKeep, kReset };

/// Watches /clock, and the stamps of each input for players that publish none.
class TimeWatch {
 public:
  /// A cloud may be this much older than the one before it without time having jumped [s].
  static constexpr double kOutOfOrder = 1.0;
  /// A cloud agrees with the one before it if it is at most this much newer [s].
  static constexpr double kLongestPause = 10.0;

  /// @return whether simulated time went back since the last call.
  bool clockWentBack() { return ros::Time::isSimTime() && clockWentBack(ros::Time::now()); }
  bool clockWentBack(const ros::Time& now) {
    const bool back = now < clock_;
    clock_ = now;
    return back;
  }

  /// @return whether two clouds of an input in a row agree that it is now earlier, by more than clouds out of
  /// order are, than other clouds that agreed had said. Of one cloud alone, ahead or behind, nothing follows;
  /// nor of a stamp of 0.
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

  /// Time starts anew.
  void restart() { inputs_.clear(); }

 private:
  /// Stamps [s].
  struct Input {
    double last = 0.0;    ///< of the last cloud
    double latest = 0.0;  ///< the latest with which the cloud after it agreed; 0: none yet
  };

  ros::Time clock_;
  std::vector<Input> inputs_;
};

}  // namespace bki_mapping::ros_shell
