# What a layer of a costmap needs of projected_map, without costmap_2d.
bki_mapping_room(costmap SOURCES grid_copy.cpp LINK ${roscpp_LIBRARIES})
