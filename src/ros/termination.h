/// @file Shutdown of programs.
#pragma once

#include <ros/init.h>

#include <csignal>

namespace bki_mapping::ros_interface {

/// Makes SIGTERM end a program as SIGINT does under ROS: ros::ok() becomes false, and destructors run. Call
/// it after ros::init.
inline void endOnTerminate() {
  std::signal(SIGTERM, [](int) { ros::requestShutdown(); });
}

}  // namespace bki_mapping::ros_interface
