# The ROS shell: nodelet, node and the programs that speak ROS.
include_directories(SYSTEM ${catkin_INCLUDE_DIRS})
bki_mapping_room(ros SOURCES
    beam_grid.cpp city_tiles.cpp clock_offset.cpp cloud_conversion.cpp cloud_frame.cpp color_reader.cpp
    corrected_poses.cpp distance_section_config.cpp input_config.cpp input_notes.cpp kept_map.cpp
    label_reader.cpp live_settings.cpp load_advice.cpp map_cloud.cpp map_file_settings.cpp
    mapping_diagnostics.cpp mapping_server.cpp mapping_services.cpp no_returns.cpp odometry_poses.cpp point_account.cpp
    point_field.cpp point_times.cpp pose_source.cpp publisher_set.cpp publishers/*.cpp queries/*.cpp
    query_services.cpp recent_map.cpp recording_mapper.cpp ring_axis.cpp scan_ledger.cpp scan_reader.cpp
    score_reader.cpp sensor_trajectory.cpp server_config.cpp tf_jumps.cpp
  LINK bki_mapping_city bki_mapping_export bki_mapping_journal ${catkin_LIBRARIES})
set(BKI_MAPPING_ROS_HEADERS
  <Eigen/Geometry> <dynamic_reconfigure/server.h> <memory> <mutex> <ros/ros.h> <sensor_msgs/PointCloud2.h> <string>
  <tf2_ros/buffer.h> <vector> <visualization_msgs/MarkerArray.h>)
bki_mapping_precompile_files(bki_mapping_ros ${BKI_MAPPING_ROS_HEADERS})
# What the programs that use these headers have from Boost: GCC would leave the headers unused if definitions differed.
target_compile_definitions(bki_mapping_ros
  PUBLIC $<BUILD_INTERFACE:$<TARGET_PROPERTY:Boost::program_options,INTERFACE_COMPILE_DEFINITIONS>>)
add_dependencies(bki_mapping_ros ${PROJECT_NAME}_generate_messages_cpp ${PROJECT_NAME}_gencfg)
# Messages first: Ninja 1.11 would generate them after all other libraries, and one processor would wait for their headers.
add_dependencies(bki_mapping_core ${PROJECT_NAME}_generate_messages_cpp ${PROJECT_NAME}_gencfg)

bki_mapping_join(bki_mapping_ros)
if(BKI_MAPPING_JOIN AND NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
  # Two files take 18 s of processor time less than four. With sanitizers they would take too much memory.
  set_target_properties(bki_mapping_ros PROPERTIES UNITY_BUILD_BATCH_SIZE 32)
endif()
bki_mapping_light(bki_mapping_ros)
bki_mapping_shell_flags(bki_mapping_ros)
# bki_mapping_uses_ros(TARGET): includes ROS, so it is compiled as the shell is.
function(bki_mapping_uses_ros target)
  bki_mapping_shell_flags(${target})
  bki_mapping_light(${target})
  if(NOT BKI_MAPPING_JOIN)
    bki_mapping_precompile(${target} REUSE bki_mapping_ros)
  endif()
endfunction()

add_library(bki_mapping_nodelets SHARED src/ros/mapping_nodelet.cpp)
target_link_libraries(bki_mapping_nodelets PRIVATE bki_mapping_ros)
bki_mapping_warnings(bki_mapping_nodelets)
bki_mapping_uses_ros(bki_mapping_nodelets)

add_executable(mapping_node src/ros/mapping_node.cpp)
target_link_libraries(mapping_node PRIVATE bki_mapping_ros)
bki_mapping_warnings(mapping_node)
bki_mapping_uses_ros(mapping_node)

add_executable(map_bag src/tools/map_bag.cpp src/tools/bag_reading.cpp)
bki_mapping_tool(map_bag bki_mapping_ros bki_mapping_export nlohmann_json::nlohmann_json)
bki_mapping_join(map_bag)
add_executable(play_sequence src/tools/play_sequence.cpp src/tools/sequence_messages.cpp)
bki_mapping_tool(play_sequence bki_mapping_ros)
bki_mapping_join(play_sequence)
add_executable(sequence_to_bag src/tools/sequence_to_bag.cpp src/tools/sequence_messages.cpp)
bki_mapping_tool(sequence_to_bag bki_mapping_ros)
bki_mapping_join(sequence_to_bag)
add_executable(print_parameters src/tools/print_parameters.cpp)
bki_mapping_tool(print_parameters bki_mapping_ros nlohmann_json::nlohmann_json)

foreach(name map_bag play_sequence sequence_to_bag print_parameters)
  bki_mapping_uses_ros(${name})
endforeach()

# Where pluginlib looks without setup.bash, which sets the paths where it looks otherwise.
set(BKI_MAPPING_PLUGIN_DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(BKI_MAPPING_PLUGIN_DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}/ros)
endif()
install(TARGETS bki_mapping_nodelets
  ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
  LIBRARY DESTINATION ${BKI_MAPPING_PLUGIN_DESTINATION}
  RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
install(TARGETS map_bag mapping_node play_sequence print_parameters sequence_to_bag
  RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY launch rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
catkin_install_python(PROGRAMS scripts/body_box.py scripts/demo_drive.py scripts/launch_path.py scripts/mapping_summary.py
  scripts/play_bag.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

# pcl_ros serves at run time: launch files load its nodelets, nothing is linked with it. Debian's describes them as being in
# lib/libpcl_ros_filters.so, but puts that into lib/<architecture>; a link of ours leads pluginlib there.
find_library(BKI_MAPPING_PCL_ROS_FILTERS pcl_ros_filters PATHS /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE} NO_DEFAULT_PATH)
mark_as_advanced(BKI_MAPPING_PCL_ROS_FILTERS)
if(BKI_MAPPING_PCL_ROS_FILTERS)
  set(link ${CATKIN_DEVEL_PREFIX}/lib/libpcl_ros_filters.so)
  file(MAKE_DIRECTORY ${CATKIN_DEVEL_PREFIX}/lib)
  file(CREATE_LINK ${BKI_MAPPING_PCL_ROS_FILTERS} ${link} SYMBOLIC)
  if(NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr")  # where packaging/debian has such a link
    #catkin_lint: ignore_once external_file
    install(FILES ${link} DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
  endif()
endif()
