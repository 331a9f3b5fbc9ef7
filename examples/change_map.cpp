// Reads a map while it grows, merges another robot's map, and takes a scan back.
#include <bki_mapping/mapping/semantic_mapper.h>
#include <bki_mapping/rules/voxel_state.h>
#include <bki_mapping/settings/yaml.h>

#include <future>
#include <iostream>

using namespace bki_mapping;

// A wall 5 m ahead of the sensor.
Scan wallFrom(double x) {
  Scan scan;
  scan.origin = {x, 0.0, 1.0};
  for (float y = -3.0f; y <= 3.0f; y += 0.1f) {
    for (float z = -1.0f; z <= 1.0f; z += 0.1f) scan.points.emplace_back(5.0f, y, z);
  }
  scan.labels.assign(scan.points.size(), 50);  // SemanticKITTI's building
  return scan;
}

std::size_t occupiedIn(const SemanticMap& map, const StateRules& rules) {
  std::size_t count = 0;
  forEachKnownVoxel(
      map, rules, [&](const VoxelIndex&, const VoxelView& v) { count += v.state == VoxelState::kOccupied; });
  return count;
}

int main() try {
  const auto classes = std::make_shared<const ClassTable>(loadClassTable("semantic_kitti"));
  SemanticMapper robot(MapperConfig(), classes), other(MapperConfig(), classes);
  robot.integrate(wallFrom(0.0));

  // A snapshot stays as it is; another thread reads it while mapping goes on.
  const MapSnapshot before = robot.snapshot();
  auto reader = std::async(std::launch::async, [&] { return occupiedIn(before.map, before.rules); });
  robot.integrate(wallFrom(20.0));
  std::cout << reader.get() << " occupied voxels, then " << occupiedIn(robot.map(), robot.rules()) << "\n";

  // Maps are sums: another robot's is added, in any order.
  other.integrate(wallFrom(40.0));
  robot.addMap(other.map());
  std::cout << occupiedIn(robot.map(), robot.rules()) << " with the other robot's\n";

  // A scan that was wrong is taken back, as if it had never been there.
  robot.withdraw(wallFrom(20.0));
  robot.withdraw(wallFrom(40.0));
  std::cout << occupiedIn(robot.map(), robot.rules()) << " without the last two scans\n";
  if (occupiedIn(robot.map(), robot.rules()) != occupiedIn(before.map, before.rules))
    throw std::runtime_error("the scans are not taken back");
} catch (const std::exception& error) {
  std::cerr << "change_map: " << error.what() << "\n";
  return 1;
}
