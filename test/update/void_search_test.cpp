// Void voxels, found block by block, are those that a look at all 26 neighbours finds.
#include <gtest/gtest.h>

#include <random>

#include "bki_mapping/core/grid_geometry.h"
#include "update/void_search.h"

namespace bki_mapping {
namespace {

/// The scan's word on a voxel. Voxels of other blocks are not seen.
bool isSeen(const IndexNumbering& blocks, VoidSearch& search, const VoxelIndex& voxel) {
  const std::uint32_t position = blocks.find(GridGeometry::blockOf(voxel));
  if (position == kNoPosition) return false;
  const SeenVoxels& seen = search.at(position);
  const auto offset = static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel));
  return seen.crossed[offset] || seen.fixed[offset];
}

TEST(VoidSearch, EqualsALookAtAllNeighbours) {
  std::mt19937 random(5);
  for (const unsigned unseen_of_thousand : {0u, 5u, 30u, 200u}) {
    for (const std::size_t threads : {1, 3}) {
      IndexNumbering blocks;
      for (int i = 0; i < 40; ++i) {
        const auto coordinate = [&] { return static_cast<std::int32_t>(random() % 4) - 2; };
        blocks.insert({coordinate(), coordinate(), coordinate()});
      }
      VoidSearch search;
      search.start(blocks.size());
      for (std::size_t b = 0; b < blocks.size(); ++b) {
        for (std::size_t v = 0; v < kBlockVoxels; ++v) {
          if (random() % 1000 < unseen_of_thousand) continue;
          (random() % 10 == 0 ? search.at(b).fixed : search.at(b).crossed).set(v);
        }
      }
      ThreadPool pool(static_cast<int>(threads));
      search.find(blocks, pool);
      std::size_t count = 0;
      for (std::size_t b = 0; b < blocks.size(); ++b) {
        for (int v = 0; v < kBlockVoxels; ++v) {
          const VoxelIndex voxel = GridGeometry::voxelOf({blocks.members()[b]}, v);
          bool is_void = search.at(b).crossed[static_cast<std::size_t>(v)];
          for (int n = 0; n < 27 && is_void; ++n) {
            is_void =
                isSeen(blocks, search, {{voxel.x + n % 3 - 1, voxel.y + n / 3 % 3 - 1, voxel.z + n / 9 - 1}});
          }
          ASSERT_EQ(search.voidsOf(b)[static_cast<std::size_t>(v)], is_void) << b << ' ' << v;
          count += is_void;
        }
      }
      EXPECT_GT(count, 0u);
    }
  }
}

}  // namespace
}  // namespace bki_mapping
