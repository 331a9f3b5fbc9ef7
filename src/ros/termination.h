/// @file How programs end.
#pragma once

#include <ros/init.h>

#include <csignal>

namespace bki_mapping::ros_shell {

/// Lets SIGTERM end a program as ROS lets SIGINT: ros::ok() becomes false, and destructors have their say. To
/// be called after ros::init.
inline void endOnTerminate() {
  std::signal(SIGTERM, [](int) { ros::requestShutdown(); });
}

}  // namespace bki_mapping::ros_shell
