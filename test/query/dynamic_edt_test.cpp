// The distance field against DynamicEDT3D, which propagates obstacles from voxel to voxel: equal but where
// that finds an obstacle that is not quite the nearest, and then never farther.
#include <dynamicEDT3D/dynamicEDT3D.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <vector>

#include "bki_mapping/query/distance_field.h"
#include "query/query_map.h"

namespace bki_mapping {
namespace {

double secondsOf(const std::chrono::steady_clock::time_point& begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

TEST(DistanceField, AgreesWithDynamicEdt3d) {
  QueryMapKind kind;
  kind.blocks = 7;
  kind.occupied = 0.01;
  const SemanticMap map = queryMap(51, kind);
  const StateMap states(map, queryRules(), 1);
  DistanceField(states, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)});
  auto begin = std::chrono::steady_clock::now();
  const DistanceField field(states, {Eigen::Vector3d(-14, -13, -6), Eigen::Vector3d(13, 14, 6)});
  const double seconds = secondsOf(begin);

  const Eigen::Vector3i size = field.size();
  // They take an array of arrays of arrays, and delete it.
  bool*** const obstacles = new bool**[static_cast<std::size_t>(size.x())];
  for (int x = 0; x < size.x(); ++x) {
    obstacles[x] = new bool*[static_cast<std::size_t>(size.y())];
    for (int y = 0; y < size.y(); ++y) {
      obstacles[x][y] = new bool[static_cast<std::size_t>(size.z())];
      for (int z = 0; z < size.z(); ++z) {
        const VoxelIndex voxel = {{field.min().x + x, field.min().y + y, field.min().z + z}};
        obstacles[x][y][z] = states.state(voxel) == VoxelState::kOccupied;
      }
    }
  }
  begin = std::chrono::steady_clock::now();
  DynamicEDT3D other(1 << 24);
  other.initializeMap(size.x(), size.y(), size.z(), obstacles);
  other.update();
  const double seconds_of_other = secondsOf(begin);

  std::size_t different = 0;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const VoxelIndex voxel = {{field.min().x + x, field.min().y + y, field.min().z + z}};
        const float ours = std::max(0.0f, field.distance(voxel)) / static_cast<float>(field.resolution()),
                    theirs = other.getDistance(x, y, z);
        ASSERT_LT(ours, theirs + 1e-4f) << x << ' ' << y << ' ' << z;
        different += ours < theirs - 1e-4f;
      }
    }
  }
  const std::size_t voxels = field.distances().size();
  std::printf("%zu voxels: %.1f ms on one thread; DynamicEDT3D %.1f ms, %zu farther than the nearest\n",
              voxels, 1e3 * seconds, 1e3 * seconds_of_other, different);
  EXPECT_LT(different, voxels / 1000);
}

}  // namespace
}  // namespace bki_mapping
