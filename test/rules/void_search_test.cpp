// Void voxels, found block by block, are those that a look at the neighbours of each finds.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/rules/scan_rules.h"
#include "reference/scenes.h"
#include "rules/class_sets.h"
#include "rules/void_search.h"

namespace bki_mapping {
namespace {

/// The scan's word on a voxel. Voxels of other blocks are not seen.
bool has(const IndexNumbering& blocks, VoidSearch& search, const VoxelIndex& voxel,
         VoxelMask SeenVoxels::*mask) {
  const std::uint32_t position = blocks.find(GridGeometry::blockOf(voxel));
  return position != kNoPosition &&
         (search.at(position).*mask)[static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel))];
}

/// Crossed, or between crossed voxels below and above, without a hit.
bool isEmpty(const IndexNumbering& blocks, VoidSearch& search, const VoxelIndex& voxel) {
  const auto crossed = [&](int step) {
    return has(blocks, search, {{voxel.x, voxel.y, voxel.z + step}}, &SeenVoxels::crossed);
  };
  const bool hit =
      has(blocks, search, voxel, &SeenVoxels::bounds) || has(blocks, search, voxel, &SeenVoxels::moving);
  return crossed(0) || (!hit && crossed(-1) && crossed(1));
}

/// Whether a voxel for which keepsAway() is true lies up to `reach` away along each axis.
template <typename KeepsAway>
bool isNear(const VoxelIndex& voxel, int reach, KeepsAway&& keepsAway) {
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        if (keepsAway(VoxelIndex{{voxel.x + x, voxel.y + y, voxel.z + z}})) return true;
      }
    }
  }
  return false;
}

void expectEqualsALookAtAllNeighbours(int thin_reach, int margin) {
  const unsigned moving_of_thousand = margin > 2 ? 10 : 1000;  // so that something is void
  std::mt19937 random(5);
  VoidSearch search;  // keeps its memory, but nothing of the scan before
  std::size_t near_thin = 0, near_moving = 0;
  for (const unsigned unseen_of_thousand : {0u, 5u, 30u, 200u}) {
    for (const std::size_t threads : {1, 3}) {
      IndexNumbering added;
      for (int i = 0; i < 40; ++i) {
        const auto coordinate = [&] { return static_cast<std::int32_t>(random() % 4) - 2; };
        added.insert({coordinate(), coordinate(), coordinate()});
      }
      BlocksByGroup by_group;  // up to eight groups
      for (const GridIndex& block : added.members()) by_group.insert({block});
      by_group.sort();
      IndexNumbering blocks;  // in the order of their groups
      for (const std::uint32_t b : by_group.numbers()) blocks.insert(added.members()[b]);
      ASSERT_EQ(blocks.size(), added.size());
      search.start(blocks.size(), thin_reach, margin);
      for (std::size_t b = 0; b < blocks.size(); ++b) {
        search.at(b) = {};
        if (b % 7 == 3) continue;  // neither crossed nor hit
        for (std::size_t v = 0; v < kBlockVoxels; ++v) {
          if (random() % 1000 < unseen_of_thousand) continue;
          const auto kind = random() % 50;
          const bool is_moving = kind == 5 && random() % 1000 < moving_of_thousand;
          (kind < 5 ? search.at(b).bounds : is_moving ? search.at(b).moving : search.at(b).crossed).set(v);
          if (kind <= 5 && random() % 100 == 0) search.at(b).hit.set(v);
        }
      }
      ThreadPool pool(static_cast<int>(threads));
      search.find(by_group, pool);
      std::size_t count = 0, bridged = 0;
      for (std::size_t b = 0; b < blocks.size(); ++b) {
        for (int v = 0; v < kBlockVoxels; ++v) {
          const VoxelIndex voxel = GridGeometry::voxelOf({blocks.members()[b]}, v);
          bool is_void = isEmpty(blocks, search, voxel);
          bridged += is_void && !search.at(b).crossed[static_cast<std::size_t>(v)];
          for (int n = 0; n < 27 && is_void; ++n) {
            const int x = n % 3 - 1, y = n / 3 % 3 - 1, z = n / 9 - 1;
            if (std::abs(x) + std::abs(y) + std::abs(z) == 3) continue;  // across a corner
            const VoxelIndex at{{voxel.x + x, voxel.y + y, voxel.z + z}};
            is_void = isEmpty(blocks, search, at) || has(blocks, search, at, &SeenVoxels::bounds);
          }
          const auto isThin = [&](const VoxelIndex& at) {
            return has(blocks, search, at, &SeenVoxels::hit) &&
                   isEmpty(blocks, search, {{at.x, at.y, at.z - 1}});
          };
          const auto isMoving = [&](const VoxelIndex& at) {
            return has(blocks, search, at, &SeenVoxels::moving);
          };
          if (thin_reach > 0 && is_void && isNear(voxel, thin_reach, isThin)) {
            is_void = false;
            ++near_thin;
          }
          if (margin > 0 && is_void && isNear(voxel, margin, isMoving)) {
            is_void = false;
            ++near_moving;
          }
          ASSERT_EQ(search.voidsOf(b)[static_cast<std::size_t>(v)], is_void) << b << ' ' << v;
          count += is_void;
        }
      }
      EXPECT_GT(count, 0u);
      if (unseen_of_thousand == 30) {
        EXPECT_GT(bridged, 0u);
      }
    }
  }
  EXPECT_EQ(near_thin > 0, thin_reach > 0);
  EXPECT_EQ(near_moving > 0, margin > 0);
}

TEST(VoidSearch, EqualsALookAtAllNeighbours) {
  expectEqualsALookAtAllNeighbours(0, 0);
}

TEST(VoidSearch, NothingNearThinThingsIsVoid) {
  for (const int reach : {1, 3, ScanRules::kMostReach}) expectEqualsALookAtAllNeighbours(reach, 0);
}

TEST(VoidSearch, NothingNearWhatCanMoveIsVoid) {
  for (const int margin : {1, 2, ScanRules::kMostReach}) expectEqualsALookAtAllNeighbours(0, margin);
  expectEqualsALookAtAllNeighbours(1, 2);
}

TEST(VoidSearch, TheMarginIsRoundedDownToVoxels) {
  EXPECT_EQ(voidMargin(0.2, 0.1), 2);
  EXPECT_EQ(voidMargin(0.2, 0.15), 1);
  EXPECT_EQ(voidMargin(0.2, 0.3), 0);
  EXPECT_EQ(voidMargin(0.3, 0.1), 3) << "0.3 / 0.1 is a little less than 3";
  EXPECT_EQ(voidMargin(0.0, 0.1), 0);
  EXPECT_EQ(voidMargin(2.0, 0.1), ScanRules::kMostReach);
}

TEST(VoidSearch, ThingsMayBeThinWhereNoClassSaysWhatCanMove) {
  EXPECT_EQ(thinReach(*reference::smallTable(), 0.1), 3);
  EXPECT_EQ(thinReach(*reference::smallTable(), 0.15), 2);
  EXPECT_EQ(thinReach(*reference::smallTable(), 0.2), 1) << "no more than 0.3 m";
  EXPECT_EQ(thinReach(*reference::smallTable(), 0.3), 1);
  EXPECT_EQ(thinReach(*reference::smallTable(), 1.0), 1);
  EXPECT_EQ(thinReach(*reference::smallTable(), 0.01), ScanRules::kMostReach);
  EXPECT_EQ(thinReach(*reference::tableWithDynamicClass(), 0.1), 0);
}

}  // namespace
}  // namespace bki_mapping
