# catkin: dependencies, messages and what the package exports. Before any target, so that catkin places them.
set(BKI_MAPPING_CATKIN_COMPONENTS
  diagnostic_updater dynamic_reconfigure geometry_msgs map_msgs message_generation nav_msgs nodelet pluginlib rosbag roscpp
  rosgraph_msgs sensor_msgs std_msgs std_srvs tf2 tf2_msgs tf2_ros topic_tools visualization_msgs)
find_package(catkin REQUIRED COMPONENTS ${BKI_MAPPING_CATKIN_COMPONENTS})

add_message_files(DIRECTORY msg)
add_service_files(DIRECTORY srv)
generate_messages(DEPENDENCIES geometry_msgs nav_msgs sensor_msgs std_msgs)
generate_dynamic_reconfigure_options(cfg/Mapping.cfg)

catkin_package(
  INCLUDE_DIRS include
  LIBRARIES bki_mapping_mapping bki_mapping_city bki_mapping_export
  CATKIN_DEPENDS diagnostic_updater dynamic_reconfigure geometry_msgs map_msgs message_runtime nav_msgs nodelet roscpp
    rosgraph_msgs sensor_msgs std_msgs std_srvs tf2 tf2_msgs tf2_ros topic_tools visualization_msgs
  DEPENDS EIGEN3
  CFG_EXTRAS bki_mapping-extras.cmake
)
