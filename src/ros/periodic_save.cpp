#include "ros/periodic_save.h"

namespace bki_mapping::ros_interface {

void PeriodicSave::update(MapKeeper& keeper, double period, Clock::time_point now, bool due) {
  if (saving_.valid() && saving_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    saving_.get();
    saved_ = saving_since_;
  }
  if (!due && (!unsaved_ || period <= 0.0 || now - begun_ < std::chrono::duration<double>(period))) return;
  saveNow(keeper, now);
}

void PeriodicSave::saveNow(MapKeeper& keeper, Clock::time_point now) {
  if (saving_.valid()) return;
  begun_ = now;
  saving_since_ = ros::WallTime::now();
  saving_ = keeper.save();
  unsaved_ = false;
}

}  // namespace bki_mapping::ros_interface
