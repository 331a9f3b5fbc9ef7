# Sequences, exports and cities, and the programs that need no ROS: PCL's file formats, OctoMap and pictures.
# Of pcl_io only PCD files are used: the sensors and windows that it also knows take a second to find, and
# what it says of them is of no use.
foreach(package OpenNI OpenNI2 VTK)
  set(CMAKE_DISABLE_FIND_PACKAGE_${package} ON)
endforeach()
find_package(PCL QUIET REQUIRED COMPONENTS common io)
find_package(nlohmann_json REQUIRED)
find_package(PNG REQUIRED)
find_package(octomap REQUIRED)
include_directories(SYSTEM ${PCL_INCLUDE_DIRS})

bki_mapping_room(sequence SOURCES
    pcd_file.cpp pose_agreement.cpp pose_file.cpp scan_tables.cpp sequence_reader.cpp sequence_writer.cpp trajectory_file.cpp
  LINK bki_mapping_core)
target_link_libraries(bki_mapping_sequence PRIVATE pcl_common pcl_io)
bki_mapping_room(city SOURCES city_index.cpp region_files.cpp tiled_map.cpp LINK bki_mapping_store)
target_link_libraries(bki_mapping_city PRIVATE nlohmann_json::nlohmann_json)
bki_mapping_room(export SOURCES
    cleaned_points.cpp display_colors.cpp export_file.cpp grid_export.cpp html_export.cpp html_page.cpp map_export.cpp
    map_picture.cpp map_statistics.cpp mesh_export.cpp octomap_export.cpp open_faces.cpp voxel_drives.cpp voxel_points.cpp
  LINK bki_mapping_query bki_mapping_sequence bki_mapping_store)
target_link_libraries(bki_mapping_export PRIVATE nlohmann_json::nlohmann_json PNG::PNG yaml-cpp ZLIB::ZLIB
  ${OCTOMAP_LIBRARIES})
target_include_directories(bki_mapping_export SYSTEM PRIVATE ${OCTOMAP_INCLUDE_DIRS})
if(CMAKE_BUILD_TYPE STREQUAL "Debug")
  # OctoMap would print what it writes to standard error.
  set_source_files_properties(src/export/octomap_export.cpp PROPERTIES COMPILE_DEFINITIONS NDEBUG SKIP_PRECOMPILE_HEADERS ON)
endif()
bki_mapping_join(bki_mapping_sequence bki_mapping_city bki_mapping_export)
bki_mapping_light(bki_mapping_sequence bki_mapping_city bki_mapping_export)
foreach(room sequence city export)
  bki_mapping_precompile(bki_mapping_${room} REUSE bki_mapping_settings)
endforeach()

bki_mapping_room(tools SOURCES
    interruption.cpp options.cpp point_query.cpp run_report.cpp scan_points.cpp sequence_options.cpp trajectory_updates.cpp
  LINK bki_mapping_city bki_mapping_journal bki_mapping_query bki_mapping_sequence Boost::program_options)
target_link_libraries(bki_mapping_tools PRIVATE nlohmann_json::nlohmann_json)
bki_mapping_join(bki_mapping_tools)
target_compile_options(bki_mapping_tools PRIVATE $<$<CONFIG:Release>:-O1>)  # the work is done in the other libraries
bki_mapping_light(bki_mapping_tools)
bki_mapping_precompile(bki_mapping_tools
  <Eigen/Geometry> <boost/program_options.hpp> <filesystem> <functional> <iostream> <map> <string> <vector>)

function(bki_mapping_tool target)
  target_link_libraries(${target} PRIVATE bki_mapping_tools ${ARGN})
  bki_mapping_warnings(${target})
endfunction()
# bki_mapping_program(FOLDER NAME [library...]): a program without ROS.
function(bki_mapping_program folder name)
  add_executable(${name} ${folder}/${name}.cpp)
  bki_mapping_tool(${name} ${ARGN})
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)  # the work is done in the libraries
  bki_mapping_light(${name})
  bki_mapping_precompile(${name} REUSE bki_mapping_tools)
  set_property(GLOBAL APPEND PROPERTY BKI_MAPPING_PROGRAMS ${name})
endfunction()
foreach(name clear_map correct_map merge_maps migrate_map)
  bki_mapping_program(src/tools ${name})
endforeach()
foreach(name export_map forget_journal inspect_map map_sequence query_city)
  bki_mapping_program(src/tools ${name} bki_mapping_export nlohmann_json::nlohmann_json)
endforeach()
