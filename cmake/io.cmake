# Files and simulation, and the programs that need no ROS: yaml-cpp, nlohmann-json and PCL's file formats.
find_package(PCL REQUIRED COMPONENTS common filters io kdtree)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(PNG REQUIRED)
find_package(octomap REQUIRED)


include_directories(SYSTEM ${PCL_INCLUDE_DIRS})
bki_mapping_room(io SOURCES
    city_index.cpp class_table_yaml.cpp cleaned_points.cpp config_yaml.cpp display_colors.cpp export_file.cpp grid_export.cpp html_export.cpp html_page.cpp map_export.cpp map_picture.cpp
    label_watch.cpp map_statistics.cpp mapper_file.cpp named_file.cpp octomap_export.cpp pcd_file.cpp pose_agreement.cpp pose_file.cpp region_files.cpp scan_tables.cpp sequence_reader.cpp sequence_writer.cpp share_path.cpp tiled_map.cpp trajectory_file.cpp truth_cloud.cpp voxel_drives.cpp voxel_pcl.cpp voxel_points.cpp yaml_file.cpp
  LINK bki_mapping_mapping bki_mapping_query bki_mapping_store)
target_compile_definitions(bki_mapping_io PRIVATE BKI_MAPPING_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
target_link_libraries(bki_mapping_io PRIVATE pcl_common pcl_io yaml-cpp nlohmann_json::nlohmann_json PNG::PNG ZLIB::ZLIB ${OCTOMAP_LIBRARIES} ${CMAKE_DL_LIBS})
target_include_directories(bki_mapping_io SYSTEM PRIVATE ${OCTOMAP_INCLUDE_DIRS})
# In debug builds OctoMap would print what it writes to standard error.
set_source_files_properties(src/io/octomap_export.cpp PROPERTIES COMPILE_DEFINITIONS NDEBUG SKIP_PRECOMPILE_HEADERS ON)
bki_mapping_room(simulation SOURCES city.cpp drive_file.cpp lidar.cpp scene.cpp street.cpp street_parts.cpp voxel_truth.cpp LINK bki_mapping_io)
target_link_libraries(bki_mapping_simulation PRIVATE yaml-cpp)
bki_mapping_room(evaluation SOURCES cloud_evaluation.cpp dynamics_evaluation.cpp label_noise.cpp occupancy_evaluation.cpp occupants.cpp octomap_mapper.cpp pose_noise.cpp presence_evaluation.cpp quality_report.cpp reliability.cpp semantic_evaluation.cpp truth_evaluation.cpp
  LINK bki_mapping_simulation bki_mapping_beams)
target_include_directories(bki_mapping_evaluation SYSTEM PRIVATE ${OCTOMAP_INCLUDE_DIRS})
set_source_files_properties(src/evaluation/octomap_mapper.cpp PROPERTIES COMPILE_DEFINITIONS NDEBUG SKIP_PRECOMPILE_HEADERS ON)
target_link_libraries(bki_mapping_evaluation PRIVATE nlohmann_json::nlohmann_json pcl_common pcl_kdtree ${OCTOMAP_LIBRARIES})
bki_mapping_join(bki_mapping_io bki_mapping_simulation bki_mapping_evaluation)
bki_mapping_precompile(bki_mapping_io
  <Eigen/Geometry> <algorithm> <filesystem> <fstream> <functional> <map> <memory> <optional> <set> <string> <vector>)
bki_mapping_room(tools SOURCES draw.cpp interruption.cpp options.cpp point_file.cpp point_query.cpp run_report.cpp sequence_options.cpp
  LINK bki_mapping_simulation bki_mapping_query Boost::program_options)
target_link_libraries(bki_mapping_tools PRIVATE nlohmann_json::nlohmann_json)
# Of one file: precompiled headers serve only targets with all the definitions of theirs.
set_source_files_properties(src/tools/options.cpp PROPERTIES COMPILE_DEFINITIONS BKI_MAPPING_VERSION="${BKI_MAPPING_VERSION}")
target_compile_options(bki_mapping_tools PRIVATE $<$<CONFIG:Release>:-O1>)  # the work is done in the other libraries
bki_mapping_precompile(bki_mapping_tools
  <Eigen/Geometry> <boost/program_options.hpp> <filesystem> <functional> <iostream> <map> <string> <vector>)

function(bki_mapping_tool target)
  target_link_libraries(${target} PRIVATE bki_mapping_tools ${ARGN})
  bki_mapping_warnings(${target})
endfunction()
foreach(name map_sequence clear_map evaluate_map export_map inspect_map merge_maps migrate_map query_city simulate_city simulate_drive)
  add_executable(${name} src/tools/${name}.cpp)
  bki_mapping_tool(${name})
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)  # the work is done in the libraries
  bki_mapping_precompile(${name} REUSE bki_mapping_tools)
endforeach()
target_link_libraries(evaluate_map PRIVATE bki_mapping_evaluation)
target_link_libraries(inspect_map PRIVATE nlohmann_json::nlohmann_json)
add_executable(benchmark_sequence benchmark/benchmark_sequence.cpp benchmark/curves.cpp)
bki_mapping_tool(benchmark_sequence pcl_filters)
add_executable(benchmark_store benchmark/benchmark_store.cpp)
bki_mapping_tool(benchmark_store)
find_package(benchmark QUIET)  # Google Benchmark: for developers
if(benchmark_FOUND)
  add_executable(benchmark_parts benchmark/benchmark_parts.cpp)
  bki_mapping_tool(benchmark_parts bki_mapping_query benchmark::benchmark)
endif()
