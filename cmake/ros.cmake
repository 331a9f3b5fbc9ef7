# The ROS shell: nodelet, node and the programs that speak ROS.
include_directories(SYSTEM ${catkin_INCLUDE_DIRS} ${pcl_conversions_INCLUDE_DIRS})
add_library(bki_mapping_ros SHARED
  src/ros/cloud_conversion.cpp
  src/ros/color_reader.cpp
  src/ros/input_config.cpp
  src/ros/label_reader.cpp
  src/ros/live_settings.cpp
  src/ros/load_advice.cpp
  src/ros/map_publishing.cpp
  src/ros/mapping_diagnostics.cpp
  src/ros/mapping_server.cpp
  src/ros/mapping_services.cpp
  src/ros/no_returns.cpp
  src/ros/point_account.cpp
  src/ros/point_field.cpp
  src/ros/pose_source.cpp
  src/ros/publishers/cell_markers.cpp
  src/ros/publishers/elevation_map.cpp
  src/ros/publishers/occupancy.cpp
  src/ros/publishers/projected_map.cpp
  src/ros/publishers/registry.cpp
  src/ros/publishers/trajectory.cpp
  src/ros/publishers/voxel_cloud.cpp
  src/ros/scan_ledger.cpp
  src/ros/scan_reader.cpp
  src/ros/score_reader.cpp
  src/ros/server_config.cpp
  src/tools/sequence_messages.cpp
)
target_link_libraries(bki_mapping_ros PUBLIC bki_mapping_io ${catkin_LIBRARIES})
add_dependencies(bki_mapping_ros ${PROJECT_NAME}_generate_messages_cpp ${PROJECT_NAME}_gencfg)
bki_mapping_warnings(bki_mapping_ros)

add_library(bki_mapping_nodelets SHARED src/ros/mapping_nodelet.cpp)
target_link_libraries(bki_mapping_nodelets PRIVATE bki_mapping_ros)
bki_mapping_warnings(bki_mapping_nodelets)

add_executable(mapping_node src/ros/mapping_node.cpp)
target_link_libraries(mapping_node PRIVATE bki_mapping_ros)
bki_mapping_warnings(mapping_node)

add_executable(play_sequence src/tools/play_sequence.cpp)
bki_mapping_tool(play_sequence bki_mapping_ros)
add_executable(sequence_to_bag src/tools/sequence_to_bag.cpp)
bki_mapping_tool(sequence_to_bag bki_mapping_ros)

add_executable(benchmark_publishing benchmark/benchmark_publishing.cpp)
bki_mapping_tool(benchmark_publishing bki_mapping_ros)

install(TARGETS bki_mapping_core bki_mapping_io bki_mapping_ros bki_mapping_nodelets
  ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
  RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
install(TARGETS benchmark_publishing benchmark_sequence evaluate_map map_sequence mapping_node play_sequence
  sequence_to_bag simulate_drive
  RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
if(TARGET benchmark_parts)
  install(TARGETS benchmark_parts RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
endif()
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
install(DIRECTORY config launch rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(FILES scripts/plot_curves.py scripts/plot_errors.py DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/scripts)
catkin_install_python(PROGRAMS scripts/class_table_path.py scripts/mapping_summary.py scripts/play_bag.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
