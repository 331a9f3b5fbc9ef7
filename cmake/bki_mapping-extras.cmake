# The imported targets bki_mapping::ROOM, such as bki_mapping::mapping, bki_mapping::store and bki_mapping::city; docs/cpp.md
# lists them. With catkin, find_package reads this file among others; without, it is all that find_package reads.
include(CMakeFindDependencyMacro)
find_dependency(Eigen3)
find_dependency(Threads)
include(${bki_mapping_DIR}/bki_mapping-targets.cmake)
