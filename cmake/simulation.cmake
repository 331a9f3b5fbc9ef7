# The simulation of drives, for the demo and the lab. No robot needs it.
bki_mapping_room(simulation FOLDER lab/simulation SOURCES
    city.cpp drive_file.cpp furniture.cpp lidar.cpp oncoming.cpp plots.cpp relief.cpp rooms.cpp scene.cpp
    shape_index.cpp street.cpp street_along.cpp street_parts.cpp truth_cloud.cpp voxel_truth.cpp way.cpp weather.cpp
  LINK bki_mapping_sequence bki_mapping_settings)
target_link_libraries(bki_mapping_simulation PRIVATE yaml-cpp)
bki_mapping_join(bki_mapping_simulation)
bki_mapping_light(bki_mapping_simulation)
bki_mapping_precompile(bki_mapping_simulation REUSE bki_mapping_settings)
bki_mapping_program(lab/tools simulate_drive bki_mapping_simulation)
