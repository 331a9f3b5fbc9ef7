// Blocks are created and erased as in a std::map, memory is reused, and all blocks near a point are found.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "bki_mapping/map/semantic_map.h"
#include "reference/content.h"

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

TEST(SemanticMap, AMapThatIsAddedMayGiveAwayItsRegions) {
  using reference::contentOf;
  // Regions of either map alone and of both; in some of these the evidence cancels out.
  const auto mapOf = [](int from, int to, EvidenceUnits units) {
    SemanticMap map(GridGeometry(0.3), 0.001, 3);
    std::mt19937 random(7);
    for (int n = 0; n < 3000; ++n) {
      const BlockIndex index = randomBlock(random);
      EvidenceUnits plane[kBlockVoxels] = {};
      plane[n % kBlockVoxels] = units;
      if (index.x >= from && index.x < to) map.getOrAllocate(index).add(1, plane);
    }
    return map;
  };
  SemanticMap copied = mapOf(-40, 5, 3), moved = mapOf(-40, 5, 3), other = mapOf(-5, 40, -3);
  const auto before = contentOf(moved), of_other = contentOf(other);
  const SemanticMap snapshot = moved.snapshot(), snapshot_of_other = other.snapshot();
  copied.add(other);
  moved.add(std::move(other));
  EXPECT_TRUE(contentOf(moved) == contentOf(copied));
  EXPECT_EQ(moved.size(), copied.size());
  EXPECT_LT(moved.size(), before.size() + of_other.size() - 100) << "nothing has cancelled out";
  for (const auto& [index, block] : snapshot_of_other.entries()) {
    if (index.x >= 8) {
      ASSERT_EQ(moved.find(index), block) << "it was copied";
    }
  }
  // What is shared with snapshots is still copied when it is written to, and all of it can be erased.
  std::vector<BlockIndex> all;
  for (const auto& [index, block] : moved.entries()) all.push_back(index);
  const EvidenceUnits plane[kBlockVoxels] = {1};
  for (const BlockIndex& index : all) moved.getOrAllocate(index).add(2, plane);
  EXPECT_TRUE(contentOf(snapshot) == before);
  EXPECT_TRUE(contentOf(snapshot_of_other) == of_other);
  for (const BlockIndex& index : all) moved.erase(index);
  EXPECT_EQ(moved.size(), 0u);
  EXPECT_TRUE(moved.regions().empty());
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

TEST(SemanticMap, ErasesAndKeepsTheRest) {
  SemanticMap map(GridGeometry(1.0), 0.001, 3);
  for (int x = 0; x < 5; ++x) map.getOrAllocate({{x, 0, 0}});
  map.erase({{1, 0, 0}});
  map.erase({{9, 9, 9}});
  EXPECT_EQ(map.size(), 4u);
  EXPECT_EQ(map.find({{1, 0, 0}}), nullptr);
  for (const int x : {0, 2, 3, 4}) EXPECT_NE(map.find({{x, 0, 0}}), nullptr) << x;
}

}  // namespace
}  // namespace bki_mapping
