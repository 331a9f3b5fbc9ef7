// Blocks are created and erased as in a std::map, memory is reused, and all blocks near a point are found.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping {
namespace {

BlockIndex randomBlock(std::mt19937& random) {
  std::uniform_int_distribution<int> x(-40, 40), z(-3, 3);
  return {{x(random), x(random), z(random)}};
}

TEST(SemanticMap, EqualsAPlainMapWhateverComesAndGoes) {
  std::mt19937 random(5);
  SemanticMap map(GridGeometry(0.3), 0.001, 3);
  std::map<GridIndex, EvidenceUnits> truth;
  const auto valueAt = [](const Block& block) { return block.evidence(1)[7]; };
  for (int step = 0; step < 20000; ++step) {
    const BlockIndex index = randomBlock(random);
    if (step % 3 == 2 || (step > 15000 && step % 3 == 1)) {
      map.erase(index);
      truth.erase(index);
    } else {
      EvidenceUnits plane[kBlockVoxels] = {};
      plane[7] = step % 100 + 1;
      map.getOrAllocate(index).add(1, plane);
      truth[index] += plane[7];
    }
    if (step == 12345) {
      map.clear();
      truth.clear();
    }
  }
  ASSERT_EQ(map.size(), truth.size());
  ASSERT_GT(truth.size(), 1000u);
  for (const auto& [index, value] : truth) {
    const Block* block = map.find({index});
    ASSERT_NE(block, nullptr);
    EXPECT_EQ(valueAt(*block), value);
  }
}

TEST(SemanticMap, ASumOfNothingHasNoBlocks) {
  SemanticMap map(GridGeometry(0.3), 0.001, 3), minus(GridGeometry(0.3), 0.001, 3);
  EvidenceUnits plane[kBlockVoxels] = {};
  for (const int x : {0, 1}) {
    plane[7] = 5;
    map.getOrAllocate({{x, 0, 0}}).add(1, plane);
  }
  plane[7] = -5;
  minus.getOrAllocate({{1, 0, 0}}).add(1, plane);
  map.add(minus);
  ASSERT_EQ(map.size(), 1u);
  EXPECT_NE(map.find({{0, 0, 0}}), nullptr);
}

TEST(SemanticMap, AWindowThatMovesOnTakesNoMoreMemory) {
  SemanticMap map(GridGeometry(0.3), 0.001, 3);
  std::size_t at_start = 0;
  for (int x = 0; x < 100000; ++x) {
    EvidenceUnits plane[kBlockVoxels] = {1};
    map.getOrAllocate({{x, x / 7, 0}}).add(1, plane);
    map.erase({{x - 50, (x - 50) / 7, 0}});
    if (x == 1000) at_start = map.bytes();
  }
  EXPECT_EQ(map.size(), 50u);
  EXPECT_LE(map.bytes(), at_start);
}

TEST(SemanticMap, FindsAllBlocksNearAPointAndNoneTwice) {
  std::mt19937 random(6);
  SemanticMap map(GridGeometry(0.3), 0.001, 3);
  for (int step = 0; step < 6000; ++step) map.getOrAllocate(randomBlock(random));
  for (int step = 0; step < 3000; ++step) map.erase(randomBlock(random));
  std::uniform_real_distribution<double> coordinate(-110.0, 110.0);
  for (const double radius : {0.0, 5.0, 30.0, 1e4, 1e300}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Eigen::Vector3d point(coordinate(random), coordinate(random), 0.1 * coordinate(random));
      std::set<GridIndex> found;
      map.forEachBlockNear(point, radius, [&](const BlockIndex& index) {
        EXPECT_NE(map.find(index), nullptr);
        EXPECT_TRUE(found.insert(index).second);
      });
      for (const auto& entry : map.entries()) {
        const Eigen::Vector3d low = map.geometry().blockOrigin(entry.index);
        const Eigen::Vector3d high = low.array() + map.geometry().blockSize();
        const Eigen::Vector3d nearest = point.cwiseMax(low).cwiseMin(high);
        if ((nearest - point).norm() <= radius) {
          EXPECT_TRUE(found.count(entry.index));
        }
      }
    }
  }
}

}  // namespace
}  // namespace bki_mapping
