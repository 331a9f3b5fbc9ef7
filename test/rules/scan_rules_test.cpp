// What the threshold takes from the bottom layer of a block and what is given back there later make, to the
// bit, what a block gets at once that knows the voxels below it. Blocks come in the order that this needs.
// And what hits say of voids beside them.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "kernel/sparse_kernel.h"
#include "map/blocks_by_group.h"
#include "rules/apply_scan_rules.h"
#include "update/sum_kernels.h"

namespace bki_mapping {
namespace {

constexpr int kVoxelsOfLayer = kBlockEdge * kBlockEdge;

/// The units that a block gets from sums.
std::vector<EvidenceUnits> unitsAfter(const ScanRules& rules, const std::vector<float>& sums,
                                      const VoxelMask& is_protected, std::uint64_t below, BlockSeam* seam) {
  BlockSums free;
  free.reserve(1);
  BlockSums::Plane& plane = free.open(kFreeClass);
  std::copy(sums.begin(), sums.end(), plane.values);
  applyToFree(rules, limitKernelsFor(""), is_protected, below, free, seam);
  std::vector<EvidenceUnits> units(kBlockVoxels, 0);
  SumCounts counts;
  sumKernelsFor("").add(plane.values, {}, units.data(), counts);
  return units;
}

TEST(ScanRules, TheThresholdIsTheMostThatABeamAddsInTheGround) {
  // A beam to level ground has the weight y / height at the height y, about y away from a voxel's centre.
  const double peak = 0.3, length = 0.4, height = 1.5;
  double most = 0.0;
  for (double y = 0.0; y < length; y += 1e-4) {
    most =
        std::max(most, y / height * peak *
                           static_cast<double>(sparseKernel(static_cast<float>(y * y / (length * length)))));
  }
  EXPECT_NEAR(groundThreshold(peak, length, height), most, 0.01 * most);
}

TEST(ScanRules, GiveBackWhatTheThresholdHasTakenAboveCrossedVoxels) {
  std::mt19937 random(7);
  std::size_t held_back = 0, given_back = 0;
  for (int n = 0; n < 400; ++n) {
    ScanRules rules;
    const float scale = std::exp2(static_cast<float>(n % 17 - 8));
    rules.free_threshold = scale * std::uniform_real_distribution<float>(0.01f, 1.0f)(random);
    rules.most_free = scale * std::uniform_real_distribution<float>(0.01f, 1.0f)(random);
    const float both = rules.free_threshold + rules.most_free;
    const float special[] = {0.0f,       rules.free_threshold,       rules.most_free,
                             both,       std::nextafter(both, 0.0f), std::nextafter(both, 2.0f * both),
                             2.0f * both};
    std::vector<float> sums;
    for (int v = 0; v < kBlockVoxels; ++v) {
      sums.push_back(v % 2 == 0 ? special[random() % std::size(special)]
                                : scale * std::uniform_real_distribution<float>(0.0f, 2.5f)(random));
    }
    VoxelMask is_protected;
    for (int i = 0; i < 20; ++i) is_protected.set(random() % kBlockVoxels);
    const std::uint64_t below = std::uint64_t{random()} << 32 | random();
    const std::vector<EvidenceUnits> expected = unitsAfter(rules, sums, is_protected, below, nullptr);

    std::vector<float> kept(kVoxelsOfLayer);
    BlockSeam seam;
    seam.sums = kept.data();
    std::vector<EvidenceUnits> units = unitsAfter(rules, sums, is_protected, 0, &seam);
    for (int v = 0; v < kVoxelsOfLayer; ++v) {
      if ((seam.held_back & below) >> v & 1) {
        units[static_cast<std::size_t>(v)] += heldBack(rules, kept[static_cast<std::size_t>(v)]);
        ++given_back;
      }
    }
    ASSERT_EQ(units, expected) << "case " << n;
    held_back += static_cast<std::size_t>(__builtin_popcountll(seam.held_back));
  }
  EXPECT_GT(given_back, 1000u);
  EXPECT_GT(held_back, given_back);
}

TEST(ScanRules, OfWhatCanMoveOnlyTheVoxelsThatContainAHitKeepVoidsAway) {
  constexpr ClassId kRoad = 1, kCar = 2;
  ScanRules rules;
  rules.fixed.set(kRoad);
  BlockSums hits;
  hits.reserve(2);
  enum { kOfRoad, kOfCar, kOfBoth, kEnd };  // by voxel: whose hits add evidence, without and with a hit in it
  for (const ClassId label : {kRoad, kCar}) {
    float* const sums = hits.open(label).values;
    std::fill_n(sums, kBlockVoxels, 0.0f);
    for (const int v : {int{label == kRoad ? kOfRoad : kOfCar}, int{kOfBoth}})
      sums[v] = sums[kEnd + v] = 0.1f;
  }
  for (int v = kEnd; v < 2 * kEnd + 1; ++v) hits.occupied.set(static_cast<std::size_t>(v));
  SeenVoxels seen;
  VoxelMask hit;
  noteHits(rules, limitKernelsFor(""), hits, seen, hit);
  EXPECT_EQ(hit.to_ullong(), 0b111111u) << "not where a hit adds no evidence";
  EXPECT_EQ(seen.bounds.to_ullong(), 0b001111u);
  EXPECT_EQ(seen.moving.to_ullong(), 0b110000u);
}

TEST(BlocksByGroup, ComesToEachBlockAfterTheOneBelow) {
  std::mt19937 random(8);
  BlocksByGroup by_group;
  for (int round = 0; round < 2; ++round) {  // it keeps its memory, but no blocks
    IndexNumbering blocks;
    by_group.clear();
    for (int i = 0; i < 300; ++i) {
      const auto coordinate = [&] { return static_cast<std::int32_t>(random() % 9) - 5; };
      blocks.insert({coordinate(), coordinate(), coordinate()});
    }
    for (const GridIndex& block : blocks.members()) by_group.insert({block});
    by_group.sort();
    ASSERT_EQ(by_group.numbers().size(), blocks.size());
    std::vector<bool> seen(blocks.size(), false);
    std::size_t next = 0;
    for (std::size_t g = 0; g < by_group.groups().size(); ++g) {
      EXPECT_EQ(by_group.begin(g), next) << "the groups follow one another";
      int before = -1;
      for (; next < by_group.end(g); ++next) {
        const std::uint32_t number = by_group.numbers()[next];
        const BlockIndex block = {blocks.members()[number]};
        EXPECT_FALSE(seen[number]);
        seen[number] = true;
        EXPECT_EQ(groupOf(block), by_group.groups().members()[g]);
        const int slot = slotInGroup(block);
        EXPECT_GT(slot, before);
        EXPECT_EQ(by_group.at(g, slot), next);
        before = slot;
      }
      EXPECT_EQ(__builtin_popcountll(by_group.slots(g)), by_group.end(g) - by_group.begin(g));
      for (int slot = 0; slot < kGroupBlocks; ++slot) {
        EXPECT_EQ(by_group.at(g, slot) == kNoPosition, (by_group.slots(g) >> slot & 1) == 0);
      }
    }
    EXPECT_EQ(next, blocks.size());
  }
}

}  // namespace
}  // namespace bki_mapping
