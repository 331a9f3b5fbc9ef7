# What is installed, and the targets that find_package(bki_mapping) gives to other packages.
get_property(bki_mapping_rooms GLOBAL PROPERTY BKI_MAPPING_ROOMS)
# Programs are made of these alone; they have no public headers.
set(bki_mapping_private_rooms ${bki_mapping_rooms})
list(FILTER bki_mapping_private_rooms INCLUDE REGEX "_(simulation|evaluation|tools|ros|costmap)$")
set(bki_mapping_public_rooms ${bki_mapping_rooms})
list(REMOVE_ITEM bki_mapping_public_rooms ${bki_mapping_private_rooms})

# Libraries find each other wherever the installation is moved to, and without setup.bash. Those of another minor version have
# another name, so that a program never meets an interface that it was not compiled for.
string(REGEX MATCH "^[0-9]+\\.[0-9]+" bki_mapping_minor_version ${BKI_MAPPING_VERSION})
set_target_properties(${bki_mapping_rooms} PROPERTIES INSTALL_RPATH "$ORIGIN"
  VERSION ${BKI_MAPPING_VERSION} SOVERSION ${bki_mapping_minor_version})
foreach(target ${bki_mapping_public_rooms})
  string(REPLACE "bki_mapping_" "" room ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${room})
endforeach()
install(TARGETS ${bki_mapping_public_rooms} EXPORT bki_mapping-targets
  ARCHIVE DESTINATION ${BKI_MAPPING_LIB_DESTINATION}
  LIBRARY DESTINATION ${BKI_MAPPING_LIB_DESTINATION}
  RUNTIME DESTINATION ${BKI_MAPPING_BIN_DESTINATION})
install(TARGETS ${bki_mapping_private_rooms}
  ARCHIVE DESTINATION ${BKI_MAPPING_LIB_DESTINATION}
  LIBRARY DESTINATION ${BKI_MAPPING_LIB_DESTINATION}
  RUNTIME DESTINATION ${BKI_MAPPING_BIN_DESTINATION})
install(EXPORT bki_mapping-targets NAMESPACE bki_mapping:: DESTINATION ${BKI_MAPPING_CMAKE_DESTINATION})

get_property(bki_mapping_programs GLOBAL PROPERTY BKI_MAPPING_PROGRAMS)
file(RELATIVE_PATH bki_mapping_from_bin /prefix/${BKI_MAPPING_BIN_DESTINATION} /prefix/${BKI_MAPPING_LIB_DESTINATION})
set_target_properties(${bki_mapping_programs} PROPERTIES INSTALL_RPATH "$ORIGIN/${bki_mapping_from_bin}")
install(TARGETS ${bki_mapping_programs} RUNTIME DESTINATION ${BKI_MAPPING_BIN_DESTINATION})

install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION include/${PROJECT_NAME})
install(DIRECTORY config web DESTINATION ${BKI_MAPPING_SHARE_DESTINATION})
if(BKI_MAPPING_LAB)
  install(FILES lab/tools/plot_curves.py lab/tools/plot_errors.py DESTINATION ${BKI_MAPPING_SHARE_DESTINATION}/lab/tools)
endif()

if(BKI_MAPPING_ROS)  # catkin installs the rest of the CMake files
  export(EXPORT bki_mapping-targets NAMESPACE bki_mapping::
    FILE ${CATKIN_DEVEL_PREFIX}/${BKI_MAPPING_SHARE_DESTINATION}/cmake/bki_mapping-targets.cmake)
else()
  include(CMakePackageConfigHelpers)
  write_basic_package_version_file(${CMAKE_BINARY_DIR}/bki_mappingConfigVersion.cmake VERSION ${BKI_MAPPING_VERSION}
    COMPATIBILITY SameMinorVersion)
  configure_file(cmake/bki_mapping-extras.cmake ${CMAKE_BINARY_DIR}/bki_mappingConfig.cmake COPYONLY)
  #catkin_lint: ignore_once missing_file
  install(FILES ${CMAKE_BINARY_DIR}/bki_mappingConfig.cmake ${CMAKE_BINARY_DIR}/bki_mappingConfigVersion.cmake
    DESTINATION ${BKI_MAPPING_CMAKE_DESTINATION})
endif()
