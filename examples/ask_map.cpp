// Asks a map file what is at a point. Usage: ask_map FILE.bkm X Y Z, in the map frame [m]
#include <bki_mapping/rules/voxel_state.h>
#include <bki_mapping/store/map_file.h>
#include <bki_mapping/store/mapper_file.h>

#include <iostream>
#include <string>

using namespace bki_mapping;

std::string nameOf(const VoxelView& voxel, const ClassTable& classes) {
  switch (voxel.state) {
    case VoxelState::kOccupied:
      return classes.find(voxel.label)->name;
    case VoxelState::kFree:
      return "free";
    case VoxelState::kOccluded:
      return "occluded";
    default:
      return "unknown";
  }
}

int main(int argc, char** argv) try {
  if (argc != 5) throw std::invalid_argument("give a map file and a point: ask_map FILE.bkm X Y Z");
  const Eigen::Vector3d point(std::stod(argv[2]), std::stod(argv[3]), std::stod(argv[4]));
  const RuledMap stored = loadRuledMap(argv[1]);
  if (!stored.map.geometry().contains(point))
    throw std::invalid_argument("the point lies outside of the grid");

  const VoxelView voxel = viewPoint(stored.map, stored.rules, point);
  std::cout << nameOf(voxel, *stored.info.classes) << ", probability " << voxel.probability << ", variance "
            << voxel.variance << ", from " << stored.drives.size() << " drives\n";

  std::size_t occupied = 0, free = 0;
  forEachKnownVoxel(stored.map, stored.rules, [&](const VoxelIndex&, const VoxelView& each) {
    if (each.state == VoxelState::kOccupied) ++occupied;
    if (each.state == VoxelState::kFree) ++free;
  });
  std::cout << occupied << " voxels of " << stored.map.geometry().resolution() << " m are occupied, " << free
            << " free\n";
} catch (const std::exception& error) {
  std::cerr << "ask_map: " << error.what() << "\n";
  return 1;
}
