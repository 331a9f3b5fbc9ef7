# The layer for costmap_2d: what it does, in a library that is always built and tested, and the plugin, where costmap_2d is.
bki_mapping_room(costmap SOURCES grid_copy.cpp LINK ${roscpp_LIBRARIES})

# package.xml requires costmap_2d only conditionally.
#catkin_lint: ignore plugin_depend
find_package(costmap_2d QUIET)
if(costmap_2d_FOUND)
  add_library(bki_mapping_costmap_layer SHARED src/costmap/semantic_layer.cpp)
  target_include_directories(bki_mapping_costmap_layer SYSTEM PRIVATE ${costmap_2d_INCLUDE_DIRS})
  target_link_libraries(bki_mapping_costmap_layer PRIVATE bki_mapping_costmap ${costmap_2d_LIBRARIES} ${catkin_LIBRARIES})
  bki_mapping_warnings(bki_mapping_costmap_layer)
  install(TARGETS bki_mapping_costmap_layer
    ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
    LIBRARY DESTINATION ${BKI_MAPPING_PLUGIN_DESTINATION}
    RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
else()
  message(STATUS "costmap_2d was not found: bki_mapping/SemanticLayer, a layer for costmaps, is left out")
endif()
install(FILES costmap_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
