// A cleared box: no evidence in it, and all of it elsewhere.
#include "bki_mapping/map/semantic_map.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>

#include "reference/content.h"
#include "store/map_maker.h"

namespace bki_mapping {
namespace {

using reference::contentOf;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The map without the voxels in the box, built voxel by voxel.
SemanticMap withoutBox(const SemanticMap& map, const Eigen::AlignedBox3d& box) {
  SemanticMap rest(map.geometry(), map.prior(), map.classCount());
  for (const auto& [index, block] : map.entries()) {
    Block& to = rest.getOrAllocate(index);
    const auto keeps = [&, i = index](int v) {
      return !box.contains(map.geometry().voxelCentre(GridGeometry::voxelOf(i, v)));
    };
    for (const ClassId id : block->classes()) {
      std::vector<EvidenceUnits> plane(kBlockVoxels);
      for (int v = 0; v < kBlockVoxels; ++v) {
        if (keeps(v)) plane[static_cast<std::size_t>(v)] = block->evidence(id)[v];
      }
      to.add(id, plane.data());
    }
    Block::Occlusion marks;
    for (int v = 0; v < kBlockVoxels; ++v) {
      const auto position = static_cast<std::size_t>(v);
      marks[position] = block->occlusion()[position] && keeps(v);
    }
    to.setOcclusion(marks);
    if (to.empty()) rest.erase(index);
  }
  return rest;
}

std::vector<GridIndex> differences(const SemanticMap& before, const SemanticMap& after) {
  const auto a = contentOf(before), b = contentOf(after);
  std::vector<GridIndex> changed;
  for (const auto& [index, content] : a) {
    const auto found = b.find(index);
    if (found == b.end() || found->second != content) changed.push_back(index);
  }
  return changed;
}

void expectCleared(unsigned seed, const Eigen::AlignedBox3d& box, bool shared) {
  const SemanticMap before = randomMap(seed);
  SemanticMap map = randomMap(seed);
  const SemanticMap snapshot = shared ? map.snapshot() : infoOf().emptyMap();
  const SemanticMap expected = withoutBox(before, box);
  const std::vector<GridIndex> changed = clearBox(map, box);
  ASSERT_TRUE(contentOf(map) == contentOf(expected))
      << box.min().transpose() << ", " << box.max().transpose();
  ASSERT_TRUE(changed == differences(before, expected));
  EXPECT_TRUE(!shared || contentOf(snapshot) == contentOf(before));
  EXPECT_TRUE(clearBox(map, box).empty());
}

TEST(ClearBox, ErasesTheVoxelsInTheBoxAlone) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-30.0, 30.0);
  for (unsigned i = 0; i < 40; ++i) {
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 2; ++corner)
      box.extend(Eigen::Vector3d(draw(random), draw(random), draw(random)));
    expectCleared(i, box, i % 2 == 0);
  }
}

TEST(ClearBox, TakesVoxelsByTheirCentres) {
  SemanticMap map = infoOf().emptyMap();
  const auto value = [&](int x) {
    const Block* block = map.find({{0, 0, 0}});
    return block ? block->evidence(40)[x] : 0;
  };
  map.getOrAllocate({{0, 0, 0}}).add(40, std::vector<EvidenceUnits>(kBlockVoxels, 5).data());
  const Eigen::Vector3d centre = map.geometry().voxelCentre({{3, 0, 0}});
  EXPECT_TRUE(
      clearBox(map, {centre + Eigen::Vector3d::Constant(1e-9), centre + Eigen::Vector3d::Constant(0.29)})
          .empty());
  EXPECT_EQ(clearBox(map, {centre, centre}), std::vector<GridIndex>(1));  // the faces belong to the box
  EXPECT_EQ(value(2), 5);
  EXPECT_EQ(value(3), 0);
  EXPECT_EQ(value(4), 5);
}

TEST(ClearBox, ErasesWhatBecomesEmpty) {
  SemanticMap map = infoOf().emptyMap();
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  plane[1] = 5;
  map.getOrAllocate({{0, 0, 0}}).add(40, plane.data());
  plane[2] = 5;
  map.getOrAllocate({{2, 0, 0}}).add(40, plane.data());
  map.getOrAllocate({{2, 0, 0}}).add(80, std::vector<EvidenceUnits>(kBlockVoxels, 5).data());
  Block::Occlusion marks;
  marks[2] = true;
  map.getOrAllocate({{1, 0, 0}}).setOcclusion(marks);
  // The first layer but its last row.
  const Eigen::AlignedBox3d box(Eigen::Vector3d::Zero(), Eigen::Vector3d(100.0, 2.1, 0.3));
  EXPECT_EQ(clearBox(map, box).size(), 3u);
  EXPECT_EQ(map.size(), 1u);
  ASSERT_TRUE(map.find({{2, 0, 0}}));
  EXPECT_EQ(map.find({{2, 0, 0}})->classes(), ClassList{80});
}

TEST(ClearBox, TakesBoxesWithoutEnd) {
  expectCleared(1, {Eigen::Vector3d(-kInfinity, -kInfinity, -5.0), Eigen::Vector3d::Constant(kInfinity)},
                true);
  SemanticMap map = randomMap(1);
  EXPECT_EQ(
      clearBox(map, {Eigen::Vector3d::Constant(-kInfinity), Eigen::Vector3d::Constant(kInfinity)}).size(),
      randomMap(1).size());
  EXPECT_EQ(map.size(), 0u);
}

TEST(ClearBox, LeavesTheMapWhereTheBoxIsEmptyOrNoNumber) {
  SemanticMap map = randomMap(1);
  EXPECT_TRUE(clearBox(map, Eigen::AlignedBox3d()).empty());
  EXPECT_TRUE(
      clearBox(map, {Eigen::Vector3d::Constant(std::nan("")), Eigen::Vector3d::Constant(9.0)}).empty());
  EXPECT_TRUE(contentOf(map) == contentOf(randomMap(1)));
}

}  // namespace
}  // namespace bki_mapping
