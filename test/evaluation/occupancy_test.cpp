// What points say of a voxel, and how often the occupancy agrees.
#include <gtest/gtest.h>

#include "evaluation/occupancy_evaluation.h"

namespace bki_mapping {
namespace {

constexpr std::uint32_t kCar = 10, kMovingCar = 252;

/// One beam from the origin to a point.
Scan beamTo(const Eigen::Vector3f& point, std::uint32_t label) {
  Scan scan;
  scan.points = {point};
  scan.labels = {label};
  return scan;
}

/// Adds evidence of 1 to the voxel x on the x axis. Voxels of 1 m.
void set(SemanticMap& map, int x, ClassId id) {
  EvidenceUnits plane[kBlockVoxels] = {};
  plane[x] = unitsOf(1.0);
  map.getOrAllocate({{0, 0, 0}}).add(id, plane);
}

TEST(Occupancy, IsJudgedByWhatStandsAndByWhatIsCrossed) {
  const GridGeometry geometry(1.0);
  OccupancyEvaluation evaluation(geometry, {kMovingCar});
  evaluation.add(beamTo({5.5f, 0.5f, 0.5f}, kCar));
  evaluation.add(beamTo({3.5f, 0.5f, 0.5f}, kMovingCar));
  evaluation.add(beamTo({6.5f, 0.5f, 0.5f}, kMovingCar));
  SemanticMap map(geometry, 0.001, 3);
  set(map, 1, 1);           // crossed: nothing is there
  set(map, 2, kFreeClass);  // the same
  set(map, 3, 1);           // the moving car has left
  set(map, 5, 1);           // the standing car
  set(map, 6, 1);           // the moving car is still there: unknown, as beams do not cross it
  set(map, 7, 1);           // neither hit nor crossed: unknown
  const Reliability quality =
      evaluation.compare(map, StateRules(), [](const VoxelIndex& voxel) { return voxel.x < 6; });
  EXPECT_EQ(quality.bins()[0].count, 1u);
  EXPECT_EQ(quality.bins()[0].right, 0u);
  EXPECT_EQ(quality.bins()[9].count, 3u) << "voxels 1, 3 and 5";
  EXPECT_EQ(quality.bins()[9].right, 1u) << "voxel 5";
}

}  // namespace
}  // namespace bki_mapping
