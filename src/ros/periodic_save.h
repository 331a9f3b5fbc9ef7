/// @file Saves the map of a server every save_period.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <future>

#include "bki_mapping/store/map_keeper.h"

namespace bki_mapping::ros_interface {

/// Begins a save when one is due and something has changed, one at a time. Never waits for the disk.
class PeriodicSave {
 public:
  using Clock = std::chrono::steady_clock;

  /// Notes that the map has evidence that is not saved.
  void noteChange() { unsaved_ = true; }
  /// @param period [s]; 0: never. @param due whether to save before it has passed.
  void update(MapKeeper& keeper, double period, Clock::time_point now, bool due = false);
  /// Begins a save, unless one is under way.
  void saveNow(MapKeeper& keeper, Clock::time_point now);
  /// Wall time up to which everything is saved; 0: nothing was saved yet.
  ros::WallTime saved() const { return saved_; }

 private:
  bool unsaved_ = false;
  std::future<void> saving_;
  ros::WallTime saving_since_, saved_;
  Clock::time_point begun_{};
};

}  // namespace bki_mapping::ros_interface
