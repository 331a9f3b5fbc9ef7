# The lab: what measures the mapper, with the simulation. No robot needs it.
find_package(PCL QUIET REQUIRED COMPONENTS common filters io kdtree)
bki_mapping_room(evaluation FOLDER lab/evaluation SOURCES
    cloud_evaluation.cpp dynamics_evaluation.cpp left_out.cpp map_evaluation.cpp noise.cpp occupancy_evaluation.cpp occupants.cpp
    octomap_mapper.cpp presence_evaluation.cpp quality_json.cpp quality_table.cpp semantic_evaluation.cpp trace_evaluation.cpp truth_evaluation.cpp
  LINK bki_mapping_simulation bki_mapping_beams)
target_link_libraries(bki_mapping_evaluation PRIVATE nlohmann_json::nlohmann_json pcl_common pcl_kdtree ${OCTOMAP_LIBRARIES})
target_include_directories(bki_mapping_evaluation SYSTEM PRIVATE ${OCTOMAP_INCLUDE_DIRS})
set_source_files_properties(lab/evaluation/octomap_mapper.cpp PROPERTIES COMPILE_DEFINITIONS NDEBUG SKIP_PRECOMPILE_HEADERS ON)
bki_mapping_join(bki_mapping_evaluation)
bki_mapping_precompile_files(bki_mapping_evaluation REUSE bki_mapping_settings)

bki_mapping_program(lab/tools simulate_city bki_mapping_simulation)
bki_mapping_program(lab/tools evaluate_map bki_mapping_evaluation pcl_filters)
target_sources(evaluate_map PRIVATE lab/tools/draw.cpp lab/tools/yardstick.cpp)

# bki_mapping_benchmark(NAME file... [LINK library...]): built and installed only with the long tests.
set(BKI_MAPPING_BENCHMARKS)
function(bki_mapping_benchmark name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  add_executable(${name} lab/benchmark/${name}.cpp ${arg_UNPARSED_ARGUMENTS})
  bki_mapping_tool(${name} bki_mapping_simulation ${arg_LINK})
  set(BKI_MAPPING_BENCHMARKS ${BKI_MAPPING_BENCHMARKS} ${name} PARENT_SCOPE)
endfunction()
bki_mapping_benchmark(benchmark_sequence lab/benchmark/curves.cpp lab/tools/draw.cpp lab/tools/yardstick.cpp LINK pcl_filters)
bki_mapping_benchmark(benchmark_store)
find_package(benchmark QUIET)  # Google Benchmark: for developers
if(benchmark_FOUND)
  bki_mapping_benchmark(benchmark_parts LINK bki_mapping_export benchmark::benchmark)
endif()
if(BKI_MAPPING_ROS)
  bki_mapping_benchmark(benchmark_publishing LINK bki_mapping_ros)
  bki_mapping_uses_ros(benchmark_publishing)
endif()
if(BKI_MAPPING_LONG_TESTS)
  set_property(GLOBAL APPEND PROPERTY BKI_MAPPING_PROGRAMS ${BKI_MAPPING_BENCHMARKS})
else()
  set_target_properties(${BKI_MAPPING_BENCHMARKS} PROPERTIES EXCLUDE_FROM_ALL ON)
endif()
