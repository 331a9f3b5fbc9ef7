# Tests: of each room, of scripts, and of the nodes.
if(NOT BUILD_TESTING AND NOT CATKIN_ENABLE_TESTING)
  return()
endif()
# GoogleTest as GTest::gtest and GTest::gtest_main: those of catkin, which in ROS Noetic builds it from its sources under
# names of its own, or else the system's, which CMake before 3.20 names in its own way.
if(NOT TARGET GTest::gtest AND NOT TARGET gtest)
  find_package(GTest REQUIRED)
endif()
if(NOT TARGET GTest::gtest)
  add_library(GTest::gtest INTERFACE IMPORTED)
  add_library(GTest::gtest_main INTERFACE IMPORTED)
  if(TARGET gtest)
    target_link_libraries(GTest::gtest INTERFACE gtest)
    target_link_libraries(GTest::gtest_main INTERFACE gtest_main)
  else()
    target_link_libraries(GTest::gtest INTERFACE GTest::GTest)
    target_link_libraries(GTest::gtest_main INTERFACE GTest::Main)
  endif()
endif()

add_library(bki_mapping_reference STATIC test/reference/reference.cpp)
target_include_directories(bki_mapping_reference PUBLIC test)
target_link_libraries(bki_mapping_reference PUBLIC bki_mapping_mapping)
# Without sanitizers, with which it would take minutes: it is what the mapper is compared with, not what runs on robots.
target_compile_options(bki_mapping_reference PRIVATE -O2 -fno-sanitize=all)
bki_mapping_warnings(bki_mapping_reference)

# How long a unit test may take [s].
if(CMAKE_CROSSCOMPILING_EMULATOR)
  set(BKI_MAPPING_TEST_SECONDS 3600)
else()
  set(BKI_MAPPING_TEST_SECONDS 600)
endif()

# Tests that compute count as two processors, and rostests, which mostly wait, as one: scripts/test tells ctest that there
# are twice as many as there are.

# Less optimised than what they test: that takes a third off their compile time.
function(bki_mapping_test_options target)
  target_compile_options(${target} PRIVATE -O1)
  bki_mapping_warnings(${target})
  bki_mapping_outer_flags(${target})
endfunction()

unset(BKI_MAPPING_FIRST_TEST CACHE)
# bki_mapping_unit_tests(ROOM name...): test/ROOM/NAME_test.cpp, linked with the room and the reference.
function(bki_mapping_unit_tests room)
  foreach(each ${ARGN})
    set(name ${each}_test)
    add_executable(${name} test/${room}/${name}.cpp)
    target_link_libraries(${name} PRIVATE bki_mapping_${room} bki_mapping_reference GTest::gtest GTest::gtest_main)
    target_compile_definitions(${name} PRIVATE BKI_MAPPING_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    bki_mapping_test_options(${name})
    if(NOT BKI_MAPPING_FIRST_TEST)
      bki_mapping_precompile(${name}
        <gtest/gtest.h> <Eigen/Geometry> <algorithm> <cmath> <fstream> <map> <random> <string> <vector>)
      set(BKI_MAPPING_FIRST_TEST ${name} CACHE INTERNAL "Whose precompiled headers the other tests use")
    elseif(NOT name STREQUAL BKI_MAPPING_FIRST_TEST)
      bki_mapping_precompile(${name} REUSE ${BKI_MAPPING_FIRST_TEST})
    endif()
    add_test(NAME ${name} COMMAND ${name})
    # Where the last line names a skipped test, none failed: GoogleTest lists those after them.
    set_tests_properties(${name} PROPERTIES TIMEOUT ${BKI_MAPPING_TEST_SECONDS} PROCESSORS 2
      SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\] [^\n]*\n*$")
  endforeach()
endfunction()

bki_mapping_unit_tests(core atomic_file grid_geometry)
bki_mapping_unit_tests(parallel group_by thread_pool)
bki_mapping_unit_tests(kernel sparse_kernel)
bki_mapping_unit_tests(map clear_box column_map map_query read_block semantic_map)
bki_mapping_unit_tests(store damaged_file faulty_disk full_disk hostile_file killed map_file map_keeper power_cut slow_disk tile_codec version_1)
add_executable(write_example_map test/store/write_example_map.cpp)
target_include_directories(write_example_map PRIVATE test)
target_link_libraries(write_example_map PRIVATE bki_mapping_store)
bki_mapping_test_options(write_example_map)
target_link_libraries(version_1_test PRIVATE ZLIB::ZLIB)
# Their own open, write and so on stand before those of the C library, for all libraries.
foreach(name faulty_disk killed power_cut slow_disk)
  target_sources(${name}_test PRIVATE test/store/watched_disk.cpp)
  target_link_libraries(${name}_test PRIVATE ${CMAKE_DL_LIBS})
  set_target_properties(${name}_test PROPERTIES ENABLE_EXPORTS ON)
endforeach()
target_sources(faulty_disk_test PRIVATE test/store/simulated_disk.cpp)
target_sources(power_cut_test PRIVATE test/store/simulated_disk.cpp)
# bki_mapping_fuzzer(NAME file...): test/store/fuzz_NAME.cpp, which reads the files and folders as a test; or, with libFuzzer
# (scripts/fuzz), what it makes of them.
option(BKI_MAPPING_LIBFUZZER "Build the fuzzers with libFuzzer; needs Clang, and -fsanitize=fuzzer-no-link in its flags" OFF)
function(bki_mapping_fuzzer name)
  list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/test/store/data/)
  add_executable(fuzz_${name} test/store/fuzz_${name}.cpp)
  target_include_directories(fuzz_${name} PRIVATE test)
  target_link_libraries(fuzz_${name} PRIVATE bki_mapping_store GTest::gtest SQLite::SQLite3 ZLIB::ZLIB)
  bki_mapping_test_options(fuzz_${name})
  if(BKI_MAPPING_LIBFUZZER)
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  else()
    target_sources(fuzz_${name} PRIVATE test/store/fuzz_corpus.cpp)
    add_test(NAME fuzz_${name} COMMAND fuzz_${name} ${ARGN})
    set_tests_properties(fuzz_${name} PROPERTIES TIMEOUT ${BKI_MAPPING_TEST_SECONDS})
  endif()
endfunction()
bki_mapping_fuzzer(map_file fuzz_map_file version_1.bkm)
bki_mapping_fuzzer(tile_codec fuzz_tile_codec)
if(BKI_MAPPING_LIBFUZZER)
  target_sources(fuzz_map_file PRIVATE test/store/fuzz_map_file_mutator.cpp)
endif()
foreach(name damaged_file hostile_file tile_codec)
  target_link_libraries(${name}_test PRIVATE SQLite::SQLite3 ZLIB::ZLIB)
endforeach()
bki_mapping_unit_tests(store map_clear map_merge migration)
bki_mapping_unit_tests(query distance_field points rays shapes state_map)
find_package(dynamicEDT3D QUIET)
if(dynamicEDT3D_FOUND)
  bki_mapping_unit_tests(query dynamic_edt)
  target_link_libraries(dynamic_edt_test PRIVATE ${DYNAMICEDT3D_LIBRARIES})
  target_include_directories(dynamic_edt_test SYSTEM PRIVATE ${DYNAMICEDT3D_INCLUDE_DIRS})
else()
  add_test(NAME dynamic_edt_test COMMAND sh -c "echo 'SKIPPED: needs libdynamicedt3d-dev' >&2; exit 77")
  set_tests_properties(dynamic_edt_test PROPERTIES SKIP_RETURN_CODE 77)
endif()
bki_mapping_unit_tests(points downsample point_bins tile_grid)
bki_mapping_unit_tests(update sum_kernels void_search voxel_sums)
bki_mapping_unit_tests(beams beam_index instruction_sets line_setup occlusion)
bki_mapping_unit_tests(free_space sampling)
bki_mapping_unit_tests(mapping allocation bounds brute_force laws parameters real_data scan_preprocessor snapshot)
# The laws with the loops for processors without AVX, which instruction_sets_test compares with brute force.
foreach(name instruction_sets laws)
  add_test(NAME ${name}_generic_test COMMAND ${name}_test)
  set_tests_properties(${name}_generic_test PROPERTIES TIMEOUT ${BKI_MAPPING_TEST_SECONDS} PROCESSORS 2
    ENVIRONMENT "BKI_MAPPING_INSTRUCTION_SET=generic")
endforeach()
set_property(TEST instruction_sets_generic_test APPEND PROPERTY ENVIRONMENT "GTEST_FILTER=*GenericIsAlwaysThere")
bki_mapping_unit_tests(io class_table cleaned_points grid_export html_export map_export map_picture octomap_export pcd_file sequence tiled_map yaml_file)
bki_mapping_unit_tests(simulation city_scene navigation simulation)
add_executable(plan_path_example examples/plan_path.cpp)
set_target_properties(plan_path_example PROPERTIES OUTPUT_NAME plan_path)
target_link_libraries(plan_path_example PRIVATE bki_mapping_io bki_mapping_query)
bki_mapping_test_options(plan_path_example)
target_include_directories(navigation_test PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(navigation_test PRIVATE bki_mapping_query)
target_compile_definitions(navigation_test PRIVATE BKI_MAPPING_PLAN_PATH="$<TARGET_FILE:plan_path_example>")
add_dependencies(navigation_test plan_path_example)
# The drive through traffic takes a minute, so it is a test of its own.
set_tests_properties(navigation_test PROPERTIES ENVIRONMENT "GTEST_FILTER=-*Traffic*")
add_test(NAME traffic_test COMMAND navigation_test)
set_tests_properties(traffic_test PROPERTIES ENVIRONMENT "GTEST_FILTER=*Traffic*" TIMEOUT ${BKI_MAPPING_TEST_SECONDS} PROCESSORS 2
  COST 80 LABELS long)
bki_mapping_unit_tests(evaluation cloud dynamics noise occupancy semantics truth)
target_link_libraries(clear_box_test PRIVATE bki_mapping_store)
target_link_libraries(instruction_sets_test PRIVATE bki_mapping_points)
target_link_libraries(parameters_test PRIVATE bki_mapping_io)
target_link_libraries(real_data_test PRIVATE bki_mapping_io)
target_link_libraries(html_export_test PRIVATE nlohmann_json::nlohmann_json ZLIB::ZLIB)
target_link_libraries(map_export_test PRIVATE pcl_io)
target_link_libraries(map_picture_test PRIVATE PNG::PNG)
target_link_libraries(cleaned_points_test PRIVATE pcl_io)
set_target_properties(cleaned_points_test PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)  # likewise
target_link_libraries(pcd_file_test PRIVATE pcl_io)
set_target_properties(pcd_file_test PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)  # likewise
target_link_libraries(grid_export_test PRIVATE yaml-cpp)
target_link_libraries(octomap_export_test PRIVATE ${OCTOMAP_LIBRARIES})
target_include_directories(octomap_export_test SYSTEM PRIVATE ${OCTOMAP_INCLUDE_DIRS})
set_target_properties(map_export_test PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)  # VTK brings Qt, which wants -fPIC
target_link_libraries(yaml_file_test PRIVATE bki_mapping_simulation yaml-cpp)

# Tests in Python: the programs as a user calls them, and the layering of the rooms.
function(bki_mapping_script_test room name)
  add_test(NAME ${name} COMMAND /usr/bin/python3 ${PROJECT_SOURCE_DIR}/test/${room}/${name}.py)
  set_tests_properties(${name} PROPERTIES TIMEOUT 300 PROCESSORS 2
    ENVIRONMENT "BKI_MAPPING_BIN=$<TARGET_FILE_DIR:map_sequence>;BKI_MAPPING_SOURCE_DIR=${PROJECT_SOURCE_DIR};BKI_MAPPING_BUILD=${CMAKE_BINARY_DIR}")
endfunction()
bki_mapping_script_test(io browser_test)
set_tests_properties(browser_test PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600)
bki_mapping_script_test(scripts figures_test)
bki_mapping_script_test(house layering_test)
bki_mapping_script_test(house links_test)
bki_mapping_script_test(house skip_test)
bki_mapping_script_test(simd nehalem_test)
set_tests_properties(nehalem_test PROPERTIES SKIP_RETURN_CODE 77)
bki_mapping_script_test(store read_map_test)
bki_mapping_script_test(city city_reading_test)
foreach(name city_test city_bags_test city_real_bag_test)
  bki_mapping_script_test(city ${name})
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 900)
endforeach()
set_tests_properties(city_test PROPERTIES COST 80 LABELS long)
bki_mapping_script_test(tools tools_test)
if(TARGET bki_mapping_python)
  get_filename_component(python_path ${BKI_MAPPING_PYTHON_BUILD} DIRECTORY)
  foreach(name city_map_test examples_test module_test queries_test ros_test stubs_test)
    bki_mapping_script_test(python ${name})
    set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT "PYTHONPATH=${python_path}")
  endforeach()
  bki_mapping_script_test(python path_test)
  set_property(TEST path_test APPEND PROPERTY ENVIRONMENT "PYTHONPATH=${python_path}")
  if(TARGET benchmark_parts)  # that the comparison runs, not how fast
    add_test(NAME compare_python_test COMMAND /usr/bin/python3 ${PROJECT_SOURCE_DIR}/benchmark/compare_python.py
      --programs $<TARGET_FILE_DIR:benchmark_parts> --repeats 1 --only PointStates,FrontierSizes)
    set_tests_properties(compare_python_test PROPERTIES TIMEOUT 300 PROCESSORS 2 ENVIRONMENT "PYTHONPATH=${python_path}"
      PASS_REGULAR_EXPRESSION "PointStates +[0-9.]+ +[0-9.]+ +[0-9.]+\nFrontierSizes +[0-9.]+ +[0-9.]+ +[0-9.]+\n$")
  endif()
endif()
add_test(NAME vector_symbols_test
  COMMAND /usr/bin/python3 ${PROJECT_SOURCE_DIR}/test/simd/vector_symbols_test.py
    $<TARGET_OBJECTS:bki_mapping_core> $<TARGET_OBJECTS:bki_mapping_parallel> $<TARGET_OBJECTS:bki_mapping_simd>
    $<TARGET_OBJECTS:bki_mapping_map> $<TARGET_OBJECTS:bki_mapping_kernel> $<TARGET_OBJECTS:bki_mapping_update>
    $<TARGET_OBJECTS:bki_mapping_points> $<TARGET_OBJECTS:bki_mapping_beams> $<TARGET_OBJECTS:bki_mapping_query>
    $<TARGET_OBJECTS:bki_mapping_free_space> $<TARGET_OBJECTS:bki_mapping_mapping> $<TARGET_OBJECTS:bki_mapping_store>)

if(CATKIN_ENABLE_TESTING)
  bki_mapping_script_test(tools commands_test)
  bki_mapping_script_test(scripts generated_parameters_test)
  set_property(TEST commands_test APPEND PROPERTY ENVIRONMENT "BKI_MAPPING_DEVEL=${CATKIN_DEVEL_PREFIX}")
  find_package(rostest REQUIRED)
  catkin_install_python(PROGRAMS
    test/ros/body_box_rostest.py test/ros/city_rostest.py test/ros/filters_rostest.py test/ros/follower_rostest.py test/ros/killed_rostest.py
    test/ros/launch_rostest.py test/ros/lifecycle_rostest.py test/ros/live_rostest.py test/ros/map_file_rostest.py
    test/ros/mapping_rostest.py test/ros/navigation_rostest.py test/ros/publishing_rostest.py test/ros/queries_rostest.py
    test/ros/query_latency_rostest.py test/ros/real_bag_rostest.py test/ros/replay_rostest.py
    test/ros/two_mappers_rostest.py
    DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  bki_mapping_unit_tests(costmap grid_copy)
  # The layer itself, with a stand-in for costmap_2d, which Debian does not have.
  #catkin_lint: ignore ambiguous_include_path
  add_library(semantic_layer_for_test MODULE src/costmap/semantic_layer.cpp)
  target_include_directories(semantic_layer_for_test SYSTEM PRIVATE test/costmap/stand_in)
  target_link_libraries(semantic_layer_for_test PRIVATE bki_mapping_costmap ${catkin_LIBRARIES})
  bki_mapping_test_options(semantic_layer_for_test)
  add_executable(semantic_layer_test test/costmap/semantic_layer_test.cpp)
  target_include_directories(semantic_layer_test SYSTEM PRIVATE test/costmap/stand_in)
  target_link_libraries(semantic_layer_test PRIVATE GTest::gtest ${catkin_LIBRARIES})
  target_compile_definitions(semantic_layer_test PRIVATE BKI_MAPPING_LAYER="$<TARGET_FILE:semantic_layer_for_test>")
  bki_mapping_test_options(semantic_layer_test)
  add_dependencies(semantic_layer_test semantic_layer_for_test)
  add_rostest(test/costmap/semantic_layer.test)
  bki_mapping_unit_tests(ros cloud_conversion kept_city query_services recent_map scan_account scan_reader sensor_trajectory server_config)
  # nodelet 1.10.0, in Debian 11, may lose the callback by which nodelets of pcl_ros learn of a subscriber
  # (ros/nodelet_core, pull request 107, fixed in the next version).
  foreach(name body_box filters)
    if(nodelet_VERSION VERSION_EQUAL 1.10.0)
      add_test(NAME ${name}_rostest COMMAND sh -c "echo 'SKIPPED: needs another nodelet than 1.10.0' >&2; exit 77")
      set_tests_properties(${name}_rostest PROPERTIES SKIP_RETURN_CODE 77)
    else()
      add_rostest(test/ros/${name}.test)
    endif()
  endforeach()
  if(TARGET bki_mapping_python)
    add_rostest(test/ros/follower.test)
  else()
    add_test(NAME follower_rostest COMMAND sh -c "echo 'SKIPPED: needs the Python module' >&2; exit 77")
    set_tests_properties(follower_rostest PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  add_rostest(test/ros/city.test)
  add_rostest(test/ros/killed.test)
  add_rostest(test/ros/launch.test)
  add_rostest(test/ros/lifecycle.test)
  add_rostest(test/ros/live.test)
  add_rostest(test/ros/map_file.test)
  add_rostest(test/ros/mapping_node.test)
  add_rostest(test/ros/mapping_nodelet.test)
  add_rostest(test/ros/navigation.test)
  add_rostest(test/ros/publishing.test)
  add_rostest(test/ros/queries.test)
  add_rostest(test/ros/query_latency.test)
  add_rostest(test/ros/replay.test)
  # rostest does not report skipped tests, so a wrapper tells ctest beforehand.
  add_test(NAME real_bag_rostest
    COMMAND ${PROJECT_SOURCE_DIR}/test/with_data bags/luminar_no_label_no_tf.bag ${CATKIN_ENV}
      rostest --pkgdir=${PROJECT_SOURCE_DIR} --package=${PROJECT_NAME} --results-filename test_ros_real_bag.xml
      --results-base-dir ${CATKIN_TEST_RESULTS_DIR} ${PROJECT_SOURCE_DIR}/test/ros/real_bag.test)
  set_tests_properties(real_bag_rostest PROPERTIES TIMEOUT 300 SKIP_RETURN_CODE 77)
  add_rostest(test/ros/two_mappers.test)
  # Found by rostest where catkin puts executables; loads the nodelet into its own process.
  add_executable(soak_test test/ros/soak_test.cpp)
  target_link_libraries(soak_test PRIVATE bki_mapping_ros bki_mapping_simulation GTest::gtest ${catkin_LIBRARIES})
  bki_mapping_test_options(soak_test)
  add_dependencies(soak_test bki_mapping_nodelets)
  add_rostest(test/ros/soak.test)
  # Likewise: a hostile publisher.
  add_executable(hostile_test test/ros/hostile_test.cpp test/ros/hostile/calls.cpp test/ros/hostile/clouds.cpp
    test/ros/hostile/queries.cpp test/ros/hostile/transforms.cpp)
  target_include_directories(hostile_test PRIVATE test)
  target_link_libraries(hostile_test PRIVATE bki_mapping_ros GTest::gtest ${catkin_LIBRARIES})
  target_compile_definitions(hostile_test PRIVATE BKI_MAPPING_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  bki_mapping_test_options(hostile_test)
  add_dependencies(hostile_test bki_mapping_nodelets)
  add_rostest(test/ros/hostile.test)
  # The longest start first; they mostly wait, and other tests compute meanwhile.
  set_tests_properties(_ctest_${PROJECT_NAME}_rostest_test_ros_replay.test commands_test PROPERTIES COST 100)
  set_tests_properties(commands_test PROPERTIES TIMEOUT 900)
  set_tests_properties(real_bag_rostest PROPERTIES COST 20)
  # Long, and on one processor: their limits of time are many times what they take.
  foreach(name soak hostile)
    set_tests_properties(_ctest_${PROJECT_NAME}_rostest_test_ros_${name}.test PROPERTIES COST 90 LABELS long)
  endforeach()
  set_tests_properties(commands_test PROPERTIES LABELS long)
  # They limit times, which another test at the same time would change.
  foreach(name publishing query_latency)
    set_tests_properties(_ctest_${PROJECT_NAME}_rostest_test_ros_${name}.test PROPERTIES RUN_SERIAL TRUE)
  endforeach()
endif()
