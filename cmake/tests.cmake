# Unit tests of the core; rostests are added in ros.cmake.
if(NOT BUILD_TESTING AND NOT CATKIN_ENABLE_TESTING)
  return()
endif()
find_package(GTest REQUIRED CONFIG)

add_library(bki_mapping_reference STATIC test/reference/reference.cpp)
target_include_directories(bki_mapping_reference PUBLIC test)
target_link_libraries(bki_mapping_reference PUBLIC bki_mapping_core)
target_compile_options(bki_mapping_reference PRIVATE -O2)
bki_mapping_warnings(bki_mapping_reference)

function(bki_mapping_unit_test name)
  add_executable(${name} test/${name}.cpp)
  target_link_libraries(${name} PRIVATE bki_mapping_reference GTest::gtest GTest::gtest_main ${ARGN})
  target_compile_definitions(${name} PRIVATE BKI_MAPPING_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  bki_mapping_warnings(${name})
  add_test(NAME ${name} COMMAND ${name})
  # Where the last line names a skipped test, none failed: GoogleTest lists those after them.
  set_tests_properties(${name} PROPERTIES TIMEOUT 600 SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\] [^\n]*\n*$")
endfunction()

foreach(name
    allocation_test beam_index_test beam_tracks_test bounds_test brute_force_test column_map_test downsample_test
    dynamics_quality_test grid_geometry_test instruction_sets_test kernel_test laws_test map_query_test
    observation_test occlusion_test parallel_for_test point_bins_test sampling_test semantic_map_test
    semantic_quality_test tile_grid_test)
  bki_mapping_unit_test(${name})
endforeach()
foreach(name atomic_file_test class_table_test map_export_test parameters_test real_data_test sequence_test simulation_test
    truth_quality_test yaml_file_test)
  bki_mapping_unit_test(${name} bki_mapping_io)
endforeach()
target_link_libraries(map_export_test PRIVATE pcl_io)
target_link_libraries(yaml_file_test PRIVATE yaml-cpp)

# Tests in Python: the programs as a user calls them, and the layering of the rooms.
function(bki_mapping_script_test name)
  add_test(NAME ${name} COMMAND /usr/bin/python3 ${PROJECT_SOURCE_DIR}/test/${name}.py)
  set_tests_properties(${name} PROPERTIES TIMEOUT 300
    ENVIRONMENT "BKI_MAPPING_BIN=$<TARGET_FILE_DIR:map_sequence>;BKI_MAPPING_SOURCE_DIR=${PROJECT_SOURCE_DIR};BKI_MAPPING_BUILD=${CMAKE_BINARY_DIR}")
endfunction()
bki_mapping_script_test(figures_test)
bki_mapping_script_test(layering_test)
bki_mapping_script_test(skip_test)
bki_mapping_script_test(tools_test)
add_test(NAME vector_symbols_test
  COMMAND /usr/bin/python3 ${PROJECT_SOURCE_DIR}/test/vector_symbols_test.py $<TARGET_OBJECTS:bki_mapping_core>)

if(CATKIN_ENABLE_TESTING)
  bki_mapping_script_test(commands_test)
  set_property(TEST commands_test APPEND PROPERTY ENVIRONMENT "BKI_MAPPING_DEVEL=${CATKIN_DEVEL_PREFIX}")
  find_package(rostest REQUIRED)
  catkin_install_python(PROGRAMS
    test/ros/killed_rostest.py test/ros/launch_rostest.py test/ros/lifecycle_rostest.py test/ros/live_rostest.py
    test/ros/mapping_rostest.py test/ros/publishing_rostest.py test/ros/real_bag_rostest.py test/ros/replay_rostest.py
    test/ros/two_mappers_rostest.py
    DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  bki_mapping_unit_test(cloud_conversion_test bki_mapping_ros)
  bki_mapping_unit_test(scan_account_test bki_mapping_ros)
  bki_mapping_unit_test(scan_reader_test bki_mapping_ros)
  bki_mapping_unit_test(server_config_test bki_mapping_ros)
  add_rostest(test/ros/killed.test)
  add_rostest(test/ros/launch.test)
  add_rostest(test/ros/lifecycle.test)
  add_rostest(test/ros/live.test)
  add_rostest(test/ros/mapping_node.test)
  add_rostest(test/ros/mapping_nodelet.test)
  add_rostest(test/ros/publishing.test)
  add_rostest(test/ros/replay.test)
  # rostest does not say that a test skipped: ctest is told before.
  add_test(NAME real_bag_rostest
    COMMAND ${PROJECT_SOURCE_DIR}/test/with_data bags/luminar_no_label_no_tf.bag ${CATKIN_ENV}
      rostest --pkgdir=${PROJECT_SOURCE_DIR} --package=${PROJECT_NAME} --results-filename test_ros_real_bag.xml
      --results-base-dir ${CATKIN_TEST_RESULTS_DIR} ${PROJECT_SOURCE_DIR}/test/ros/real_bag.test)
  set_tests_properties(real_bag_rostest PROPERTIES TIMEOUT 300 SKIP_RETURN_CODE 77)
  add_rostest(test/ros/two_mappers.test)
  # Found by rostest where catkin puts executables; loads the nodelet into its own process.
  add_executable(soak_test test/ros/soak_test.cpp)
  target_link_libraries(soak_test PRIVATE bki_mapping_ros GTest::gtest ${catkin_LIBRARIES})
  bki_mapping_warnings(soak_test)
  add_dependencies(soak_test bki_mapping_nodelets)
  add_rostest(test/ros/soak.test)
  # Likewise: a hostile publisher.
  add_executable(hostile_test test/ros/hostile_test.cpp test/ros/hostile/calls.cpp test/ros/hostile/clouds.cpp
    test/ros/hostile/transforms.cpp)
  target_include_directories(hostile_test PRIVATE test)
  target_link_libraries(hostile_test PRIVATE bki_mapping_ros GTest::gtest ${catkin_LIBRARIES})
  target_compile_definitions(hostile_test PRIVATE BKI_MAPPING_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  bki_mapping_warnings(hostile_test)
  add_dependencies(hostile_test bki_mapping_nodelets)
  add_rostest(test/ros/hostile.test)
endif()
