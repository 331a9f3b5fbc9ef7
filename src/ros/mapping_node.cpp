// Runs the mapping server as a node.
#include <ros/ros.h>

#include <csignal>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "ros/start_server.h"

namespace {

const char kHelp[] =
    "mapping_node: maps labelled point clouds (topic cloud_in, tf) as semantic 3D occupancy.\n"
    "It takes only ROS arguments: __name:=NAME, TOPIC:=OTHER, _PARAMETER:=VALUE. Parameters, topics and "
    "services are\n"
    "described in docs/parameters.md and docs/ros.md; launch/mapping.launch starts it with its defaults.\n";

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> arguments;
  ros::removeROSArgs(argc, argv, arguments);
  if (arguments.size() > 1) {
    if (arguments[1] == "--help" || arguments[1] == "-h") {
      std::cout << kHelp;
      return 0;
    }
    std::cerr << "mapping_node: option '" << arguments[1]
              << "' is unknown; mapping_node takes only ROS arguments (see --help)\n";
    return 1;
  }
  ros::init(argc, argv, "mapping");
  // SIGTERM ends it as SIGINT does: ros::ok() becomes false, and destructors run.
  std::signal(SIGTERM, [](int) { ros::requestShutdown(); });
  const ros::NodeHandle node,
      private_node("~");  // while a handle exists, ROS keeps the log open for the error below
  try {
    const std::shared_ptr<void> server = bki_mapping::ros_interface::startMappingServer(node, private_node);
    ros::spin();
  } catch (const std::exception& fault) {
    ROS_FATAL("%s", fault.what());
    return 1;
  }
  return 0;
}
