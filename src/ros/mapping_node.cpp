// The mapping server as a node of its own.
#include <ros/ros.h>

#include "bki_mapping/ros/mapping_server.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "mapping");
  try {
    bki_mapping::ros_shell::MappingServer server(ros::NodeHandle(), ros::NodeHandle("~"));
    ros::spin();
  } catch (const std::exception& fault) {
    ROS_FATAL("%s", fault.what());
    return 1;
  }
  return 0;
}
