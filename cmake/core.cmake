# The core: no ROS, no PCL. Everything a scan passes through until it is in the map.
add_library(bki_mapping_core SHARED
  src/core/class_table.cpp
  src/core/map_query.cpp
  src/core/named_parameter.cpp
  src/core/parameters.cpp
  src/core/semantic_map.cpp
  src/inference/beam_evidence.cpp
  src/inference/beam_field.cpp
  src/inference/beam_rtree.cpp
  src/inference/beam_table.cpp
  src/inference/beam_tracks.cpp
  src/inference/block_walk.cpp
  src/inference/cell_merger.cpp
  src/inference/downsample.cpp
  src/inference/group_sums.cpp
  src/inference/inner_loops.cpp
  src/inference/inner_loops_generic.cpp
  src/inference/kernel_table.cpp
  src/inference/map_updater.cpp
  src/inference/occlusion.cpp
  src/inference/parallel_for.cpp
  src/inference/point_bins.cpp
  src/inference/point_evidence.cpp
  src/inference/soft_point_evidence.cpp
  src/inference/tile_grid.cpp
  src/free_space/beam_lines.cpp
  src/free_space/even_samples.cpp
  src/free_space/no_free_space.cpp
  src/free_space/random_samples.cpp
  src/free_space/registry.cpp
  src/mapping/dynamics_quality.cpp
  src/mapping/column_map.cpp
  src/mapping/observation.cpp
  src/mapping/semantic_quality.cpp
  src/mapping/soft_merge.cpp
  src/mapping/semantic_mapper.cpp
)
target_include_directories(bki_mapping_core PUBLIC
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
target_link_libraries(bki_mapping_core PUBLIC Eigen3::Eigen Threads::Threads PRIVATE Boost::headers)
# Without traps and errno the compiler may use vector instructions for comparisons and roots; results stay the same.
target_compile_options(bki_mapping_core PRIVATE -fno-math-errno -fno-trapping-math
  $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition> -O3)
bki_mapping_warnings(bki_mapping_core)
# The inner loops meet no infinities or NaN; without them a choice is a minimum or a maximum, one instruction.
set(inner_loop_options -ffinite-math-only -fno-signed-zeros)
set_source_files_properties(src/inference/inner_loops_generic.cpp PROPERTIES COMPILE_OPTIONS "${inner_loop_options}")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Chosen at run time where the processor has it.
  target_sources(bki_mapping_core PRIVATE src/inference/inner_loops_avx2.cpp src/inference/inner_loops_avx512.cpp)
  set_source_files_properties(src/inference/inner_loops_avx2.cpp PROPERTIES COMPILE_OPTIONS
    "${inner_loop_options};-mavx2;-mfma")
  set_source_files_properties(src/inference/inner_loops_avx512.cpp PROPERTIES COMPILE_OPTIONS
    "${inner_loop_options};-mavx2;-mfma;-mavx512f;-mavx512dq;-mavx512bw;-mavx512vl;-mbmi2;-Wno-maybe-uninitialized")
  # The last: GCC 12 warns of its own intrinsics (its bug 105593).
  target_compile_definitions(bki_mapping_core PRIVATE BKI_MAPPING_X86)
endif()
