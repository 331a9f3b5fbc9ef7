#include <nodelet/nodelet.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "ros/start_server.h"

namespace bki_mapping::ros_interface {

/// Runs the mapping server in a nodelet manager.
class MappingNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    try {
      server_ = startMappingServer(getNodeHandle(), getPrivateNodeHandle());
    } catch (const std::exception& fault) {
      NODELET_FATAL("%s", fault.what());
      throw;  // the manager refuses to load the nodelet
    }
  }

  std::shared_ptr<void> server_;
};

}  // namespace bki_mapping::ros_interface

PLUGINLIB_EXPORT_CLASS(bki_mapping::ros_interface::MappingNodelet, nodelet::Nodelet)
