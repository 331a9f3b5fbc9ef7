// Ground, clearance, occlusion and obstacles of columns built by hand; updates equal a recomputation.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "bki_mapping/query/column_map.h"

namespace bki_mapping {
namespace {

enum : ClassId { kRoad = 0, kCar = 1, kSky = 2, kGrass = 3, kWater = 4 };

ClassTable table() {
  std::vector<SemanticClass> classes(5);
  for (std::uint8_t id = 0; id < 5; ++id) {
    classes[id].id = id;
    classes[id].name = "class" + std::to_string(id);
  }
  classes[kRoad].ground = true;
  classes[kSky].ignored = true;
  for (const ClassId id : {kGrass, kWater}) classes[id].ground = true;
  classes[kGrass].cost = 60;
  classes[kWater].cost = 100;
  return ClassTable("test", classes);
}

class Columns : public testing::Test {
 protected:
  Columns() : map_(GridGeometry(0.5), 0.001, 5) {}

  void add(const VoxelIndex& voxel, ClassId id) {
    std::vector<EvidenceUnits> plane(kBlockVoxels, 0);
    plane[static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel))] = unitsOf(1.0);
    map_.getOrAllocate(GridGeometry::blockOf(voxel)).add(id, plane.data());
  }
  void occlude(const VoxelIndex& voxel) {
    Block& block = map_.getOrAllocate(GridGeometry::blockOf(voxel));
    Block::Occlusion occlusion = block.occlusion();
    occlusion.set(static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel)));
    block.setOcclusion(occlusion);
  }
  std::vector<GridIndex> allBlocks() const {
    std::vector<GridIndex> blocks;
    for (const auto& entry : map_.entries()) blocks.push_back(entry.index);
    return blocks;
  }
  /// The column of voxels at x = y = 0.
  ColumnView column(const ColumnRules& rules = {}) const {
    ColumnMap columns;
    columns.start(rules);
    columns.update(map_, rules_, classes_);
    return *columns.find({{0, 0, 0}});
  }

  SemanticMap map_;
  StateRules rules_;
  ClassTable classes_ = table();
};

using Occupancy = ColumnView::Occupancy;

TEST_F(Columns, KnowTheGroundAndWhatIsAboveIt) {
  for (const int z : {-3, -2}) add({{0, 0, z}}, kRoad);
  add({{0, 0, 0}}, kSky);
  occlude({{0, 0, -5}});
  for (const int z : {1, 2, 10}) occlude({{0, 0, z}});
  for (const int z : {3, 4}) add({{0, 0, z}}, kCar);
  add({{0, 0, 20}}, kRoad);  // a bridge
  const ColumnView view = column();
  EXPECT_EQ(view.ground, -0.5f);
  EXPECT_EQ(view.ground_class, kRoad);
  EXPECT_EQ(view.clearance, 2.0f);  // from -0.5 m to the car's bottom at 1.5 m
  EXPECT_EQ(view.occluded, 1.5f);
  EXPECT_EQ(view.occupancy, Occupancy::kOccupied);
}

TEST_F(Columns, DistinguishFreeUnknownAndObstacles) {
  add({{0, 0, 0}}, kSky);
  EXPECT_EQ(column().occupancy, Occupancy::kUnknown);
  EXPECT_TRUE(std::isnan(column().ground));
  EXPECT_TRUE(std::isnan(column().clearance));
  add({{0, 0, 4}}, kFreeClass);
  EXPECT_EQ(column().occupancy, Occupancy::kFree);
  add({{0, 0, -4}}, kRoad);
  EXPECT_EQ(column().occupancy, Occupancy::kFree);
  EXPECT_TRUE(std::isinf(column().clearance));
  add({{0, 0, 6}}, kCar);
  EXPECT_EQ(column().occupancy, Occupancy::kOccupied);
}

TEST_F(Columns, TheVoxelRightBelowTheGroundIsNoObstacle) {
  add({{0, 0, -5}}, kCar);  // hits on tyres reach below the road
  EXPECT_EQ(column().occupancy, Occupancy::kOccupied) << "without ground, nothing is below it";
  add({{0, 0, -4}}, kRoad);
  for (const HeightReference reference : {HeightReference::kMap, HeightReference::kGround}) {
    ColumnRules rules;
    rules.reference = reference;
    EXPECT_EQ(column(rules).occupancy, Occupancy::kFree);
    EXPECT_EQ(column(rules).cost, 0);
  }
  add({{0, 0, -3}}, kCar);
  EXPECT_EQ(column().occupancy, Occupancy::kOccupied);
}

TEST_F(Columns, WhatStandsUnderADeckIsAnObstacle) {
  for (int z = 0; z < 6; ++z) add({{0, 0, z}}, kCar);  // a pillar, whose foot no beam reaches
  add({{0, 0, 6}}, kRoad);
  EXPECT_EQ(column().occupancy, Occupancy::kOccupied);
}

TEST_F(Columns, HeightsCountFromTheMapOrFromTheGround) {
  add({{0, 0, -10}}, kRoad);  // top at -4.5 m
  add({{0, 0, -5}}, kCar);    // centre at -2.25 m, 2.25 m above the ground
  ColumnRules rules;
  rules.min_z = 2.0;
  rules.max_z = 2.5;
  EXPECT_EQ(column(rules).occupancy, Occupancy::kFree);
  rules.reference = HeightReference::kGround;
  EXPECT_EQ(column(rules).occupancy, Occupancy::kOccupied);
  rules.max_z = 2.2;
  EXPECT_EQ(column(rules).occupancy, Occupancy::kFree);
  rules.reference = HeightReference::kMap;
  rules.min_z = -2.5;
  rules.max_z = -2.0;
  EXPECT_EQ(column(rules).occupancy, Occupancy::kOccupied);
}

TEST_F(Columns, WithoutGroundBelowAnObstacleCountsAtAnyHeight) {
  add({{0, 0, 30}}, kCar);
  ColumnRules rules;
  rules.max_z = 2.0;
  EXPECT_EQ(column(rules).occupancy, Occupancy::kUnknown);
  rules.reference = HeightReference::kGround;
  EXPECT_EQ(column(rules).occupancy, Occupancy::kOccupied);
}

TEST_F(Columns, CostWhatTheirGroundCosts) {
  add({{0, 0, 0}}, kSky);
  EXPECT_EQ(column().cost, -1) << "unknown";
  add({{0, 0, 3}}, kFreeClass);
  EXPECT_EQ(column().cost, 0) << "free, without ground";
  add({{0, 0, -4}}, kGrass);
  EXPECT_EQ(column().cost, 60);
  add({{0, 0, -3}}, kRoad);  // laid on it
  EXPECT_EQ(column().cost, 0);
  add({{0, 0, -2}}, kWater);
  EXPECT_EQ(column().cost, 100) << "never, although it is ground";
  EXPECT_EQ(column().occupancy, Occupancy::kFree);
  add({{0, 0, -1}}, kGrass);
  EXPECT_EQ(column().cost, 60);
  add({{0, 0, 2}}, kGrass);  // a bridge: the ground below counts
  EXPECT_EQ(column().cost, 60);
  add({{0, 0, 1}}, kCar);
  EXPECT_EQ(column().cost, 100);
  ColumnRules rules;
  rules.max_z = 0.5;  // below the car
  EXPECT_EQ(column(rules).cost, 60);
}

/// The cost, from the definition: of the class at the top of the lowest uninterrupted run of ground.
int costOf(const SemanticMap& map, const StateRules& rules, const ClassTable& classes, const ColumnView& view,
           const ColumnMap::StackIndex& stack, int cell) {
  if (view.occupancy != Occupancy::kFree) return static_cast<int>(view.occupancy);
  int cost = 0;
  bool in_ground = false;
  for (int z = -24; z < 24; ++z) {
    const VoxelIndex voxel{
        {kBlockEdge * stack.first + cell % kBlockEdge, kBlockEdge * stack.second + cell / kBlockEdge, z}};
    const VoxelView voxel_view = viewPoint(map, rules, map.geometry().voxelCentre(voxel));
    const bool ground = voxel_view.state == VoxelState::kOccupied && classes.find(voxel_view.label)->ground;
    if (in_ground && !ground) break;
    if (ground) cost = classes.find(voxel_view.label)->cost;
    in_ground = ground;
  }
  return cost;
}

TEST_F(Columns, BlocksErasedWithoutNoticeDoNoHarm) {
  add({{0, 0, 1}}, kRoad);
  add({{0, 0, 9}}, kCar);
  ColumnMap kept;
  kept.update(map_, rules_, classes_);
  map_.erase(GridGeometry::blockOf({{0, 0, 1}}));
  kept.update(map_, rules_, classes_, {GridGeometry::blockOf({{0, 0, 9}})});
  ASSERT_TRUE(kept.find({{0, 0, 0}}));
  EXPECT_TRUE(std::isnan(kept.find({{0, 0, 0}})->ground)) << "the road is still there";
}

TEST_F(Columns, UpdatesEqualARecomputation) {
  std::mt19937 random(5);
  const auto draw = [&](int edge) {
    return static_cast<int>(random() % static_cast<unsigned>(2 * edge)) - edge;
  };
  ColumnMap kept;
  rules_ = rules_.withFreeGain(kCar, 3.0);
  rules_ = rules_.withNeighbourhood(2.0, ClassSet().set(kCar));
  for (int round = 0; round < 30; ++round) {
    std::vector<GridIndex> changed;
    for (int i = 0; i < 20; ++i) {
      const VoxelIndex voxel{{draw(20), draw(20), draw(20)}};
      const ClassId ids[] = {kRoad, kCar, kSky, kFreeClass, kGrass, kWater};
      add(voxel, ids[random() % 6]);
      changed.push_back(GridGeometry::blockOf(voxel));
    }
    if (round % 5 == 4) {
      for (const GridIndex& block : allBlocks()) {
        if (block.x < 0) {
          map_.erase({block});
          changed.push_back(block);
        }
      }
    }
    kept.update(map_, rules_, classes_, changed);
    ColumnMap fresh;
    fresh.update(map_, rules_, classes_, allBlocks());
    ASSERT_EQ(kept.columns().size(), fresh.columns().size());
    for (const VoxelIndex& voxel :
         {VoxelIndex{{-20, 19, 3}}, VoxelIndex{{7, -8, -99}}, VoxelIndex{{80, 0, 0}}}) {
      const auto stack = fresh.columns().find(
          {static_cast<int>(std::floor(voxel.x / 8.0)), static_cast<int>(std::floor(voxel.y / 8.0))});
      const auto cell = static_cast<std::size_t>((voxel.x & 7) + 8 * (voxel.y & 7));
      ASSERT_EQ(fresh.find(voxel), stack == fresh.columns().end() ? nullptr : &stack->second[cell]);
    }
    const auto same = [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); };
    for (const auto& [stack, columns] : fresh.columns()) {
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const ColumnView &a = columns[c], &b = kept.columns().at(stack)[c];
        ASSERT_TRUE(same(a.ground, b.ground) && same(a.clearance, b.clearance) && a.occluded == b.occluded &&
                    a.occupancy == b.occupancy && a.ground_class == b.ground_class && a.cost == b.cost);
        ASSERT_EQ(a.cost, costOf(map_, rules_, classes_, a, stack, static_cast<int>(c)));
      }
    }
  }
}

}  // namespace
}  // namespace bki_mapping
