// OctoMaps: opened again with OctoMap, they say of each voxel what the map says.
#include "export/octomap_export.h"

#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <cmath>
#include <memory>
#include <string>

#include "bki_mapping/rules/voxel_state.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

const StateRules kRules = StateRules().withFreeGain(80, 0.1);

SemanticMap someMap() {
  SemanticMap map = randomMap(4, 60, 3);
  return map;
}

template <typename Tree>
std::unique_ptr<Tree> open(const std::string& path) {
  std::unique_ptr<octomap::AbstractOcTree> tree;
  if (path.substr(path.size() - 3) == ".bt") {
    auto binary = std::make_unique<octomap::OcTree>(1.0);
    if (binary->readBinary(path)) tree = std::move(binary);
  } else {
    tree.reset(octomap::AbstractOcTree::read(path));
  }
  auto* const found = dynamic_cast<Tree*>(tree.get());
  if (found) static_cast<void>(tree.release());
  return std::unique_ptr<Tree>(found);
}

/// The number of voxels that the leaves of a tree stand for.
template <typename Tree>
std::uint64_t voxelsOf(const Tree& tree) {
  std::uint64_t voxels = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    voxels += std::uint64_t{1} << 3 * (tree.getTreeDepth() - leaf.getDepth());
  }
  return voxels;
}

/// Compares all voxels of a map with a tree. @param compare(node, view) for voxels in both.
template <typename Tree, typename Compare>
void expectSame(const SemanticMap& map, const Tree& tree, Compare&& compare) {
  EXPECT_EQ(tree.getResolution(), map.geometry().resolution());
  std::uint64_t voxels = 0;
  int different = 0;
  forEachKnownVoxel(map, kRules, [&](const VoxelIndex& voxel, const VoxelView& view) {
    if (view.state == VoxelState::kOccluded) return;
    ++voxels;
    const Eigen::Vector3d centre = map.geometry().voxelCentre(voxel);
    const auto* const node = tree.search(centre.x(), centre.y(), centre.z());
    different +=
        !node || tree.isNodeOccupied(node) != (view.state == VoxelState::kOccupied) || !compare(*node, view);
  });
  EXPECT_GT(voxels, 10000u);
  EXPECT_EQ(different, 0);
  EXPECT_EQ(voxelsOf(tree), voxels);
}

TEST(OctoMap, HoldsTheClassOfEachVoxel) {
  const TemporaryFolder folder;
  const SemanticMap map = someMap();
  exportOctoMap(folder / "map.ot", map, kRules, *infoOf().classes);
  const auto tree = open<octomap::ColorOcTree>(folder / "map.ot");
  ASSERT_TRUE(tree);
  std::size_t occupied = 0, agreeing = 0;
  expectSame(map, *tree, [&](const octomap::ColorOcTreeNode& node, const VoxelView& view) {
    const double log_odds = std::log(view.occupancy / (1.0 - view.occupancy));
    const double limited = std::min(std::max(log_odds, double{tree->getClampingThresMinLog()}),
                                    double{tree->getClampingThresMaxLog()});
    agreeing += std::abs(node.getLogOdds() - limited) < 1e-3;
    if (view.state == VoxelState::kFree) return !node.isColorSet();
    ++occupied;
    const auto color = infoOf().classes->find(view.label)->color;
    return node.getColor() == octomap::ColorOcTreeNode::Color(color[0], color[1], color[2]);
  });
  EXPECT_GT(occupied, 1000u);
  // Where gains or several classes decide the state, the sign is that of the state instead.
  EXPECT_GT(agreeing, occupied / 2);
  EXPECT_LT(tree->getNumLeafNodes(), voxelsOf(*tree)) << "nothing is merged";
}

TEST(OctoMap, HoldsTheStateOfEachVoxel) {
  const TemporaryFolder folder;
  const SemanticMap map = someMap();
  testing::internal::CaptureStderr();
  exportOctoMap(folder / "map.bt", map, kRules, *infoOf().classes);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  const auto tree = open<octomap::OcTree>(folder / "map.bt");
  ASSERT_TRUE(tree);
  expectSame(map, *tree, [](const octomap::OcTreeNode&, const VoxelView&) { return true; });
  EXPECT_LT(tree->getNumLeafNodes(), voxelsOf(*tree)) << "nothing is merged";
}

TEST(OctoMap, EndsWhereItsKeysEnd) {
  const TemporaryFolder folder;
  const std::vector<EvidenceUnits> plane(kBlockVoxels, 9);
  for (const auto& [block, fits] : {std::pair(4095, true), std::pair(-4096, true), std::pair(4096, false),
                                    std::pair(-4097, false), std::pair(1 << 24, false)}) {
    SemanticMap map = infoOf().emptyMap();
    map.getOrAllocate({{0, block, 0}}).add(40, plane.data());
    for (const char* name : {"map.ot", "map.bt"}) {
      const std::string path = folder / name;
      std::filesystem::remove(path);
      if (!fits) {
        EXPECT_THROW(exportOctoMap(path, map, kRules, *infoOf().classes), std::invalid_argument) << block;
        EXPECT_FALSE(std::filesystem::exists(path));
        continue;
      }
      exportOctoMap(path, map, kRules, *infoOf().classes);
    }
    if (!fits) continue;
    const auto tree = open<octomap::ColorOcTree>(folder / "map.ot");
    ASSERT_TRUE(tree);
    EXPECT_EQ(voxelsOf(*tree), 512u);
    EXPECT_EQ(tree->getNumLeafNodes(), 1u);
    EXPECT_TRUE(tree->search(0.1, 0.3 * (8 * block + 0.5), 0.1));
  }
}

TEST(OctoMap, RefusesTheFirstVoxelBeyondItsKeys) {
  const TemporaryFolder folder;
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  plane[0] = 9;
  SemanticMap map = infoOf().emptyMap();
  map.getOrAllocate({{0, 0, 4096}}).add(40, plane.data());
  EXPECT_THROW(exportOctoMap(folder / "map.ot", map, kRules, *infoOf().classes), std::invalid_argument);
}

TEST(OctoMap, KeepsTheResolution) {
  const TemporaryFolder folder;
  const double resolution = 0.123456789012345678;
  SemanticMap map = infoOf(resolution).emptyMap();
  map.getOrAllocate({{1, 2, 3}}).add(40, std::vector<EvidenceUnits>(kBlockVoxels, 9).data());
  exportOctoMap(folder / "map.ot", map, kRules, *infoOf().classes);
  exportOctoMap(folder / "map.bt", map, kRules, *infoOf().classes);
  EXPECT_EQ(open<octomap::ColorOcTree>(folder / "map.ot")->getResolution(), resolution);
  EXPECT_EQ(open<octomap::OcTree>(folder / "map.bt")->getResolution(), resolution);
}

TEST(OctoMap, MayBeEmpty) {
  const TemporaryFolder folder;
  for (const char* name : {"map.ot", "map.bt"}) {
    exportOctoMap(folder / name, infoOf().emptyMap(), kRules, *infoOf().classes);
    EXPECT_TRUE(std::filesystem::exists(folder / name));
  }
  EXPECT_THROW(exportOctoMap(folder / "map.oct", infoOf().emptyMap(), kRules, *infoOf().classes),
               std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
