# The core: no ROS, no PCL. Everything a scan passes through until it is in the map, and in its file. Each room is one
# library. It may use only what it links; the linker refuses the rest.

# bki_mapping_room(NAME [FOLDER folder] SOURCES file... [LINK target...]): the library bki_mapping_NAME from files in
# src/NAME, or in the folder; a pattern with * stands for all files of a folder to which others are often added. Includes begin
# with the name of the room.
function(bki_mapping_room room)
  cmake_parse_arguments(arg "" "FOLDER" "SOURCES;LINK" ${ARGN})
  if(NOT arg_FOLDER)
    set(arg_FOLDER src/${room})
  endif()
  list(TRANSFORM arg_SOURCES PREPEND "${arg_FOLDER}/")
  set(patterns ${arg_SOURCES})
  list(FILTER patterns INCLUDE REGEX "[*]")
  list(FILTER arg_SOURCES EXCLUDE REGEX "[*]")
  foreach(pattern ${patterns})
    file(GLOB files RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS ${pattern})
    list(APPEND arg_SOURCES ${files})
  endforeach()
  get_filename_component(top ${arg_FOLDER} DIRECTORY)
  set(target bki_mapping_${room})
  add_library(${target} SHARED ${arg_SOURCES})
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/${top}> $<INSTALL_INTERFACE:include>)
  target_link_libraries(${target} PUBLIC ${arg_LINK})
  if(NOT BKI_MAPPING_LIBFUZZER)  # whose functions are in the program only
    target_link_options(${target} PRIVATE LINKER:--no-undefined)
  endif()
  set_target_properties(${target} PROPERTIES DEFINE_SYMBOL "")  # rooms share precompiled headers
  bki_mapping_warnings(${target})
  set_property(GLOBAL APPEND PROPERTY BKI_MAPPING_ROOMS ${target})
endfunction()

# A room in which scans are computed, or the map is read.
# Without traps and errno the compiler may use vector instructions for comparisons and roots; results stay the same. Not -O3 in
# Debug builds, which are for debuggers and sanitizers.
function(bki_mapping_core_room room)
  bki_mapping_room(${room} ${ARGN})
  target_compile_options(bki_mapping_${room} PRIVATE -fno-math-errno -fno-trapping-math
    $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition> $<$<NOT:$<CONFIG:Debug>>:-O3>)
  bki_mapping_join(bki_mapping_${room})
  if(room STREQUAL "core")
    bki_mapping_precompile(bki_mapping_core
      <Eigen/Geometry> <algorithm> <array> <bitset> <cmath> <map> <memory> <optional> <stdexcept> <string> <vector>
      ${PROJECT_SOURCE_DIR}/src/simd/intrinsics.h)
  else()
    bki_mapping_precompile(bki_mapping_${room} REUSE bki_mapping_core)
  endif()
endfunction()

bki_mapping_core_room(core SOURCES atomic_file.cpp class_filter.cpp class_table.cpp named_parameter.cpp unlisted_labels.cpp LINK Eigen3::Eigen)
bki_mapping_core_room(parallel SOURCES gate.cpp thread_pool.cpp LINK bki_mapping_core Threads::Threads)
bki_mapping_core_room(simd SOURCES instruction_sets.cpp)
bki_mapping_core_room(map SOURCES clear_box.cpp looks.cpp semantic_map.cpp LINK bki_mapping_parallel)
bki_mapping_core_room(rules SOURCES
    apply_scan_rules.cpp class_sets.cpp latest_looks.cpp near_voxels.cpp neighbourhood.cpp state_rules.cpp void_search.cpp voxel_state.cpp
  LINK bki_mapping_map bki_mapping_simd)
bki_mapping_core_room(kernel SOURCES kernel_table.cpp LINK bki_mapping_core bki_mapping_simd)
bki_mapping_core_room(update SOURCES map_updater.cpp sum_sink.cpp LINK bki_mapping_rules)
bki_mapping_core_room(query SOURCES
    column_map.cpp distance_field.cpp
    frontiers.cpp nearest_obstacle.cpp points.cpp rays.cpp region_frontiers.cpp section.cpp shapes.cpp state_map.cpp
  LINK bki_mapping_rules)
bki_mapping_core_room(points SOURCES
    cell_merger.cpp downsample.cpp isolated_points.cpp point_bins.cpp point_evidence.cpp tile_grid.cpp
  LINK bki_mapping_kernel bki_mapping_update)
bki_mapping_core_room(beams SOURCES
    beam_field.cpp beam_rtree.cpp beam_table.cpp block_walk.cpp line_evidence.cpp
    longest_beams.cpp near_sensor.cpp occlusion.cpp split_directions.cpp
    raster/group_sums.cpp raster/line_setup.cpp
  LINK bki_mapping_kernel bki_mapping_update)
target_link_libraries(bki_mapping_beams PRIVATE Boost::headers)
bki_mapping_core_room(free_space SOURCES *.cpp  # a new mode is a new file
  LINK bki_mapping_beams bki_mapping_points)
bki_mapping_core_room(mapping SOURCES
    former_parameters.cpp parameters.cpp scan_preprocessor.cpp semantic_mapper.cpp sensor_height.cpp soft_merge.cpp
  LINK bki_mapping_free_space)

bki_mapping_kernels(rules limit_kernels)
bki_mapping_kernels(rules state_kernels)
bki_mapping_kernels(update sum_kernels)
bki_mapping_kernels(query distance_kernels)
bki_mapping_kernels(points point_kernels kernel/kernel_table.h kernel/sparse_kernel.h)
bki_mapping_kernels(beams raster/line_kernels kernel/kernel_table.h kernel/sparse_kernel.h)

# Class tables and parameters from YAML.
find_package(yaml-cpp REQUIRED)
bki_mapping_room(settings SOURCES
    class_table_yaml.cpp config_yaml.cpp label_watch.cpp named_file.cpp yaml_file.cpp
  LINK bki_mapping_mapping)
set_source_files_properties(src/settings/named_file.cpp PROPERTIES COMPILE_DEFINITIONS BKI_MAPPING_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
target_link_libraries(bki_mapping_settings PRIVATE yaml-cpp ${CMAKE_DL_LIBS})
bki_mapping_join(bki_mapping_settings)
bki_mapping_light(bki_mapping_settings)
bki_mapping_precompile(bki_mapping_settings
  <Eigen/Geometry> <algorithm> <cmath> <filesystem> <fstream> <functional> <map> <memory> <optional> <set> <string> <vector>)

# Map files: SQLite and zlib. They name the program that wrote them.
file(STRINGS package.xml version_line REGEX "<version>")
string(REGEX REPLACE ".*<version>(.*)</version>.*" "\\1" BKI_MAPPING_VERSION "${version_line}")
find_package(SQLite3 REQUIRED)
find_package(ZLIB REQUIRED)
bki_mapping_room(store SOURCES
    database.cpp drives.cpp evidence_steps.cpp grid_transform.cpp journal_merge.cpp journal_rows.cpp look_rows.cpp
    map_clear.cpp map_file.cpp
    map_file_state.cpp map_info.cpp map_keeper.cpp map_merge.cpp mapper_file.cpp migration.cpp new_map_file.cpp records.cpp
    schema.cpp summand.cpp tile_codec.cpp tile_rows.cpp tile_store.cpp whole_map.cpp
  LINK bki_mapping_settings)
target_compile_definitions(bki_mapping_store PRIVATE BKI_MAPPING_VERSION="${BKI_MAPPING_VERSION}")
target_link_libraries(bki_mapping_store PRIVATE SQLite::SQLite3 ZLIB::ZLIB)
bki_mapping_join(bki_mapping_store)
bki_mapping_light(bki_mapping_store)
bki_mapping_precompile(bki_mapping_store REUSE bki_mapping_settings)
if(BKI_MAPPING_JOIN)
  set_target_properties(bki_mapping_store PROPERTIES UNITY_BUILD_BATCH_SIZE 28)  # one file
  # Of a class whose members are of the unnamed namespace of an included file.
  target_compile_options(bki_mapping_store PRIVATE -Wno-subobject-linkage)
endif()

# Scans as they were recorded, which follow corrected poses.
bki_mapping_core_room(journal SOURCES
    byte_planes.cpp corrected_file.cpp corrected_looks.cpp corrected_path.cpp file_correction.cpp journal_output.cpp journal_writer.cpp
    kept_scans.cpp map_corrector.cpp moved_looks.cpp point_list.cpp point_order.cpp rigid_motion.cpp scan_codec.cpp scan_journal.cpp
    scan_mover.cpp scan_poses.cpp sensor_scan.cpp stored_journal.cpp stored_settings.cpp
  LINK bki_mapping_sequence bki_mapping_store)
target_link_libraries(bki_mapping_journal PRIVATE ZLIB::ZLIB)
