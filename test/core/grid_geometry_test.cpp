// Conversions between points, voxels and blocks, also below zero and at the ends of the map.
#include <gtest/gtest.h>

#include <limits>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {
namespace {

TEST(GridGeometry, FloorsBelowZero) {
  const GridGeometry grid(0.5);
  const VoxelIndex v = grid.voxelAt({-0.01, -0.5, -0.51});
  EXPECT_EQ(v.x, -1);
  EXPECT_EQ(v.y, -1);
  EXPECT_EQ(v.z, -2);
}

TEST(GridGeometry, VoxelsAndBlocksGoTogether) {
  for (const int x : {-17, -16, -9, -8, -1, 0, 7, 8, 15, 16}) {
    const VoxelIndex v{{x, 3 - x, 2 * x}};
    const BlockIndex b = GridGeometry::blockOf(v);
    EXPECT_EQ(GridGeometry::voxelOf(b, GridGeometry::offsetInBlock(v)), v) << x;
    EXPECT_LE(b.x * kBlockEdge, x);
    EXPECT_GT((b.x + 1) * kBlockEdge, x);
  }
}

TEST(GridGeometry, CentresLieInTheirVoxel) {
  const GridGeometry grid(0.3);
  for (int offset = 0; offset < kBlockVoxels; ++offset) {
    const VoxelIndex v = GridGeometry::voxelOf({{-3, 5, 0}}, offset);
    EXPECT_EQ(grid.voxelAt(grid.voxelCentre(v)), v);
  }
}

TEST(GridGeometry, RefusesPointsWithoutAnIndex) {
  const GridGeometry grid(0.1);
  EXPECT_TRUE(grid.contains({1e6, -1e6, 0.0}));
  for (const double x : {0.0, 1e6, -2.6e7, 2.68435e7}) {  // the map ends at 2^28 voxels
    const double safe = static_cast<double>(grid.safeRange({0.0, x, 1.0}));
    EXPECT_GT(safe, 0.0) << x;
    EXPECT_TRUE(grid.contains({0.0, x + safe, 1.0}) && grid.contains({0.0, x - safe, 1.0})) << x;
  }
  EXPECT_LT(grid.safeRange({3e7, 0.0, 0.0}), 0.0f);
  EXPECT_FALSE(grid.contains({1e9, 0.0, 0.0}));
  EXPECT_FALSE(grid.contains({0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}));
  EXPECT_FALSE(grid.contains({0.0, 0.0, std::numeric_limits<double>::infinity()}));
}

}  // namespace
}  // namespace bki_mapping
