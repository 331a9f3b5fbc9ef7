// Evidence added to many voxels at once equals a plain loop over the voxels, also where whole layers change.
#include <gtest/gtest.h>

#include <random>

#include "update/voxel_sums.h"

namespace bki_mapping {
namespace {

TEST(VoxelSums, EqualAPlainLoop) {
  std::mt19937 random(3);
  const EvidenceUnits edges[] = {0, 1, -1, 70, kMostUnits, -kMostUnits, kMostUnits - 1, 1 - kMostUnits};
  std::size_t saturated = 0, negative = 0;
  for (int n = 0; n < 300; ++n) {
    LayerBits voxels;
    for (std::uint64_t& layer : voxels) {
      layer = random() % 3 == 0   ? 0
              : random() % 2 == 0 ? ~std::uint64_t{0}
                                  : random() * std::uint64_t{random()};
    }
    std::vector<EvidenceUnits> before(kBlockVoxels);
    for (EvidenceUnits& each : before) {
      each = n % 2 == 0 ? edges[random() % std::size(edges)] : static_cast<EvidenceUnits>(random() % 9);
    }
    const auto units = static_cast<EvidenceUnits>(1 + random() % 70);
    const VoxelMask mask = maskOf(voxels);
    ASSERT_EQ(bitsOf(mask), voxels);
    for (const bool withdraws : {false, true}) {
      std::vector<EvidenceUnits> expected = before, plane = before;
      SumCounts of_loop, counts;
      bool any = false;
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        ASSERT_EQ(mask[v], (voxels[v / 64] >> v % 64 & 1) != 0);
        if (!mask[v]) continue;
        const std::int64_t sum = std::int64_t{before[v]} + (withdraws ? -units : units), most = kMostUnits;
        of_loop.saturated += sum > most && before[v] < most;
        of_loop.negative += withdraws && before[v] >= 0 && sum < 0;
        expected[v] = static_cast<EvidenceUnits>(std::clamp(sum, -most, most));
        any |= expected[v] != 0;
      }
      const auto change = withdraws ? withdrawFromVoxels : addToVoxels;
      EXPECT_EQ(change(voxels, units, plane.data(), counts), any);
      // The same, layer by layer, with units for each voxel.
      std::vector<EvidenceUnits> same = before;
      const std::vector<EvidenceUnits> of_voxel(64, units);
      const auto changeLayer = withdraws ? withdrawFromLayer : addToLayer;
      SumCounts of_layers;
      bool any_of_layers = false;
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        any_of_layers |= changeLayer(voxels[z], of_voxel.data(), same.data() + 64 * z, of_layers);
      }
      EXPECT_EQ(same, expected);
      EXPECT_EQ(any_of_layers, any);
      EXPECT_EQ(of_layers.saturated, of_loop.saturated);
      EXPECT_EQ(of_layers.negative, of_loop.negative);
      ASSERT_EQ(plane, expected);
      ASSERT_EQ(counts.saturated, of_loop.saturated);
      ASSERT_EQ(counts.negative, of_loop.negative);
      saturated += counts.saturated;
      negative += counts.negative;
    }
  }
  EXPECT_GT(saturated, 0u);
  EXPECT_GT(negative, 0u);
}

TEST(VoxelSums, GiveEachVoxelOfALayerItsOwn) {
  std::vector<EvidenceUnits> units(64), plane(64, 1000), expected = plane;
  for (int v = 0; v < 64; ++v) units[static_cast<std::size_t>(v)] = 3 * v;
  const std::uint64_t voxels = 0x8000000100f00205;
  for (std::size_t v = 0; v < 64; ++v) expected[v] += (voxels >> v & 1) != 0 ? units[v] : 0;
  SumCounts counts;
  EXPECT_TRUE(addToLayer(voxels, units.data(), plane.data(), counts));
  EXPECT_EQ(plane, expected);
  EXPECT_TRUE(withdrawFromLayer(voxels, units.data(), plane.data(), counts));
  EXPECT_EQ(plane, std::vector<EvidenceUnits>(64, 1000));
}

}  // namespace
}  // namespace bki_mapping
