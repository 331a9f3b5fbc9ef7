#include "ros/periodic_save.h"

namespace bki_mapping::ros_interface {

void PeriodicSave::update(MapKeeper& keeper, double period, Clock::time_point now) {
  if (saving_.valid() && saving_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    saving_.get();
    saved_ = saving_since_;
  }
  if (!unsaved_ || saving_.valid() || period <= 0.0 || now < next_) return;
  next_ = now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(period));
  saving_since_ = ros::WallTime::now();
  saving_ = keeper.save();
  unsaved_ = false;
}

}  // namespace bki_mapping::ros_interface
