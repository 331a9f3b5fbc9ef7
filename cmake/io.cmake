# Files and simulation, and the programs that need no ROS: yaml-cpp, nlohmann-json and PCL's file formats.
find_package(PCL REQUIRED COMPONENTS common filters io)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)


include_directories(SYSTEM ${PCL_INCLUDE_DIRS})
add_library(bki_mapping_io SHARED
  src/io/atomic_file.cpp
  src/io/class_table_yaml.cpp
  src/io/config_yaml.cpp
  src/io/map_export.cpp
  src/io/report.cpp
  src/io/sequence_reader.cpp
  src/io/sequence_writer.cpp
  src/io/share_path.cpp
  src/io/voxel_pcl.cpp
  src/io/yaml_file.cpp
  src/simulation/drive_file.cpp
  src/simulation/lidar.cpp
  src/simulation/scene.cpp
  src/simulation/street.cpp
  src/simulation/truth_quality.cpp
  src/simulation/voxel_truth.cpp
  src/tools/draw.cpp
  src/tools/options.cpp
  src/tools/quality_report.cpp
)
target_compile_definitions(bki_mapping_io PRIVATE BKI_MAPPING_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
target_link_libraries(bki_mapping_io
  PUBLIC bki_mapping_core Boost::program_options pcl_common
  PRIVATE pcl_io yaml-cpp nlohmann_json::nlohmann_json ${CMAKE_DL_LIBS})
bki_mapping_warnings(bki_mapping_io)

function(bki_mapping_tool target)
  target_link_libraries(${target} PRIVATE bki_mapping_io ${ARGN})
  bki_mapping_warnings(${target})
endfunction()
add_executable(map_sequence src/tools/map_sequence.cpp)
bki_mapping_tool(map_sequence)
add_executable(evaluate_map src/tools/evaluate_map.cpp)
bki_mapping_tool(evaluate_map)
add_executable(simulate_drive src/tools/simulate_drive.cpp)
bki_mapping_tool(simulate_drive)
add_executable(benchmark_sequence benchmark/benchmark_sequence.cpp benchmark/curves.cpp)
bki_mapping_tool(benchmark_sequence pcl_filters)
find_package(benchmark QUIET)  # Google Benchmark: for developers
if(benchmark_FOUND)
  add_executable(benchmark_parts benchmark/benchmark_parts.cpp)
  bki_mapping_tool(benchmark_parts benchmark::benchmark)
endif()
