/// @file Notices when time jumps back.
#pragma once

#include <ros/time.h>

#include <vector>

namespace bki_mapping::ros_shell {

enum class OnTimeJump { kKeep, kReset };

/// Watches /clock, and the stamps of each input for players that publish none.
class TimeWatch {
 public:
  /// A cloud may be this much older than the one before it without time having jumped [s].
  static constexpr double kOutOfOrder = 1.0;

  /// @return whether simulated time went back since the last call.
  bool clockWentBack() { return ros::Time::isSimTime() && clockWentBack(ros::Time::now()); }
  bool clockWentBack(const ros::Time& now) {
    const bool back = now < clock_;
    clock_ = now;
    return back;
  }

  /// @return whether the stamps of an input went back by more than clouds out of order do, in two clouds in a
  /// row: one alone is a stray. A stamp of 0 says nothing.
  bool stampsWentBack(std::size_t input, const ros::Time& stamp) {
    if (input >= inputs_.size()) inputs_.resize(input + 1);
    if (stamp.isZero()) return false;
    Input& i = inputs_[input];
    const bool back = stamp.toSec() + kOutOfOrder < i.latest.toSec();
    const bool again = back && i.stray;
    i.stray = back && !again;
    if (again || stamp > i.latest) i.latest = stamp;
    return again;
  }

  /// Time starts anew.
  void restart() { inputs_.clear(); }

 private:
  struct Input {
    ros::Time latest;    ///< stamp
    bool stray = false;  ///< whether the last cloud was far older
  };

  ros::Time clock_;
  std::vector<Input> inputs_;
};

}  // namespace bki_mapping::ros_shell
