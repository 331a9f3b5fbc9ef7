// The mapping server as a node of its own.
#include <ros/ros.h>

#include "bki_mapping/ros/mapping_server.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "mapping");
  const ros::NodeHandle node, private_node("~");  // while one lives, ROS can still say what went wrong
  try {
    bki_mapping::ros_shell::MappingServer server(node, private_node);
    ros::spin();
  } catch (const std::exception& fault) {
    ROS_FATAL("%s", fault.what());
    return 1;
  }
  return 0;
}
