// Sums are rounded, added and taken back, and units of chosen voxels changed, as a plain loop would, on every
// instruction set.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "simd/instruction_sets.h"
#include "update/sum_kernels.h"

namespace bki_mapping {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLayer = kBlockEdge * kBlockEdge;

/// The slow, obvious reference for one voxel.
EvidenceUnits reference(EvidenceUnits before, float sum, bool withdraws, SumCounts& counts) {
  if (std::isnan(sum)) {
    ++counts.not_finite;
    sum = 0.0f;
  }
  // Greater sums count as the greatest float in the range.
  const double units = std::min(std::floor(static_cast<double>(sum) * 65536.0 + 0.5), 2147483520.0);
  const double most = 2147483647.0, after = withdraws ? before - units : before + units;
  if (std::abs(after) > most) ++counts.saturated;
  const double kept = std::max(-most, std::min(after, most));
  if (withdraws && kept < 0.0) ++counts.negative;
  return static_cast<EvidenceUnits>(kept);
}

struct Case {
  std::vector<float> sums;
  std::vector<EvidenceUnits> plane;
};

Case randomCase(std::mt19937& random, bool extreme) {
  const float special[] = {0.0f,
                           0.5f * kEvidenceUnit,
                           0.49999f * kEvidenceUnit,
                           1.5f * kEvidenceUnit,
                           32767.99f,
                           32768.0f,
                           3e38f,
                           kInfinity,
                           1e-30f,
                           127.99999f,
                           std::numeric_limits<float>::quiet_NaN()};
  const EvidenceUnits edges[] = {0, 1, -1, kMostUnits, -kMostUnits, kMostUnits - 1, 1 << 30, -(1 << 30)};
  std::uniform_real_distribution<float> exponent(-20.0f, extreme ? 15.0f : 4.0f);
  std::uniform_int_distribution<EvidenceUnits> units(extreme ? -kMostUnits : 0,
                                                     extreme ? kMostUnits : 1 << 24);
  Case made;
  for (int v = 0; v < kBlockVoxels; ++v) {
    made.sums.push_back(extreme && random() % 4 == 0 ? special[random() % std::size(special)]
                                                     : std::exp2(exponent(random)));
    made.plane.push_back(extreme && random() % 4 == 0 ? edges[random() % std::size(edges)] : units(random));
  }
  return made;
}

TEST(SumKernels, EqualAPlainLoopOnEachInstructionSet) {
  std::mt19937 random(9);
  for (int n = 0; n < 200; ++n) {
    const Case made = randomCase(random, n % 2 == 1);
    const int first = n % kBlockEdge, last = first + 1 + n % (kBlockEdge - first);
    for (const bool withdraws : {false, true}) {
      std::vector<EvidenceUnits> expected = made.plane;
      SumCounts counts;
      EvidenceUnits any = 0;
      for (int v = first * kLayer; v < last * kLayer; ++v) {
        const auto at = static_cast<std::size_t>(v);
        expected[at] = reference(made.plane[at], made.sums[at], withdraws, counts);
        any |= expected[at];
      }
      for (const std::string& set : instructionSets()) {
        const SumKernels& kernels = sumKernelsFor(set);
        std::vector<EvidenceUnits> plane = made.plane;
        SumCounts got;
        const auto add = withdraws ? kernels.withdraw : kernels.add;
        EXPECT_EQ(add(made.sums.data(), {first, last}, plane.data(), got), any != 0) << set;
        ASSERT_EQ(plane, expected) << set << ", case " << n << (withdraws ? ", taken back" : "");
        EXPECT_EQ(got.not_finite, counts.not_finite) << set;
        EXPECT_EQ(got.saturated, counts.saturated) << set;
        EXPECT_EQ(got.negative, counts.negative) << set;
      }
    }
  }
}

/// Adding in the found layers alone is adding, and there are no more of them than needed.
TEST(SumKernels, FindTheLayersThatChange) {
  std::mt19937 random(4);
  const float nothing[] = {0.0f, 1e-30f, 0.49999f * kEvidenceUnit},
              something[] = {0.5f * kEvidenceUnit, 1.0f, kInfinity, std::numeric_limits<float>::quiet_NaN()};
  for (const std::string& set : instructionSets()) {
    for (int first = 0; first <= kBlockEdge; ++first) {
      for (int last = first; last <= kBlockEdge; ++last) {
        std::vector<float> sums(kBlockVoxels);
        for (float& sum : sums) sum = nothing[random() % std::size(nothing)];
        if (first < last) {
          for (const int layer : {first, last - 1}) {
            sums[static_cast<std::size_t>(layer) * kLayer + random() % kLayer] =
                something[random() % std::size(something)];
          }
        }
        const Block::Layers found = sumKernelsFor(set).find_layers(sums.data(), {});
        EXPECT_EQ(found.end - found.begin, last - first) << set;
        if (first < last) {
          EXPECT_EQ(found.begin, first) << set;
        }
        const Block::Layers one = sumKernelsFor(set).find_layers(sums.data(), {3, 4});
        EXPECT_EQ(one.end - one.begin, first < last && (first == 3 || last == 4) ? 1 : 0) << set;
      }
    }
  }
}

TEST(SumKernels, TakeBackWhatTheyAdded) {
  std::mt19937 random(10);
  for (const std::string& set : instructionSets()) {
    for (int n = 0; n < 50; ++n) {
      const Case made = randomCase(random, false), other = randomCase(random, false);
      std::vector<EvidenceUnits> plane = made.plane;
      SumCounts counts;
      sumKernelsFor(set).add(made.sums.data(), {}, plane.data(), counts);
      sumKernelsFor(set).add(other.sums.data(), {}, plane.data(), counts);
      sumKernelsFor(set).withdraw(made.sums.data(), {}, plane.data(), counts);
      sumKernelsFor(set).withdraw(other.sums.data(), {}, plane.data(), counts);
      EXPECT_EQ(plane, made.plane) << set;
    }
  }
}

TEST(SumKernels, ChangeChosenVoxelsAsAPlainLoopDoes) {
  std::mt19937 random(3);
  const EvidenceUnits edges[] = {0, 1, -1, 70, kMostUnits, -kMostUnits, kMostUnits - 1, 1 - kMostUnits};
  std::size_t saturated = 0, negative = 0;
  for (int n = 0; n < 300; ++n) {
    std::uint64_t voxels[kBlockEdge];
    for (std::uint64_t& layer : voxels) {
      layer = random() % 3 == 0   ? 0
              : random() % 2 == 0 ? ~std::uint64_t{0}
                                  : random() * std::uint64_t{random()};
    }
    std::vector<EvidenceUnits> before(kBlockVoxels), units(kLayer);
    for (EvidenceUnits& each : before) {
      each = n % 2 == 0 ? edges[random() % std::size(edges)] : static_cast<EvidenceUnits>(random() % 9);
    }
    for (EvidenceUnits& each : units)
      each = n % 50 == 0 ? kMostUnits : static_cast<EvidenceUnits>(random() % 70);
    const int layers = 1 + n % kBlockEdge;
    for (const bool withdraws : {false, true}) {
      std::vector<EvidenceUnits> expected = before;
      SumCounts counts;
      bool any = false;
      for (int v = 0; v < layers * kLayer; ++v) {
        if ((voxels[v / kLayer] >> v % kLayer & 1) == 0) continue;
        const auto at = static_cast<std::size_t>(v);
        const EvidenceUnits change = units[at % kLayer];
        const std::int64_t sum = std::int64_t{before[at]} + (withdraws ? -change : change), most = kMostUnits;
        counts.saturated += sum > most && before[at] < most;
        counts.negative += withdraws && before[at] >= 0 && sum < 0;
        expected[at] = static_cast<EvidenceUnits>(std::clamp(sum, -most, most));
        any |= expected[at] != 0;
      }
      for (const std::string& set : instructionSets()) {
        const SumKernels& kernels = sumKernelsFor(set);
        const auto change = withdraws ? kernels.withdraw_units : kernels.add_units;
        std::vector<EvidenceUnits> plane = before;
        SumCounts got;
        EXPECT_EQ(change(voxels, layers, units.data(), plane.data(), got), any) << set;
        ASSERT_EQ(plane, expected) << set << ", case " << n << (withdraws ? ", taken back" : "");
        EXPECT_EQ(got.saturated, counts.saturated) << set;
        EXPECT_EQ(got.negative, counts.negative) << set;
        EXPECT_EQ(got.not_finite, 0u) << set;
      }
      saturated += counts.saturated;
      negative += counts.negative;
    }
  }
  EXPECT_GT(saturated, 0u);
  EXPECT_GT(negative, 0u);
}

TEST(SumKernels, SayWhetherAnythingIsLeft) {
  const std::vector<float> tiny(kBlockVoxels, 0.4f * kEvidenceUnit), one(kBlockVoxels, kEvidenceUnit);
  for (const std::string& set : instructionSets()) {
    const SumKernels& kernels = sumKernelsFor(set);
    std::vector<EvidenceUnits> plane(kBlockVoxels, 0);
    SumCounts counts;
    EXPECT_FALSE(kernels.add(tiny.data(), {}, plane.data(), counts)) << set;
    EXPECT_TRUE(kernels.add(one.data(), {}, plane.data(), counts)) << set;
    EXPECT_FALSE(kernels.withdraw(one.data(), {}, plane.data(), counts)) << set;
  }
}

TEST(Block, HasAPlaneWhereThereIsEvidence) {
  Block block;
  std::vector<EvidenceUnits> plane(kBlockVoxels, 0), minus = plane;
  plane[7] = 5;
  minus[7] = -5;
  for (const int id : {3, 255, 0, 2}) block.add(static_cast<ClassId>(id), plane.data());
  EXPECT_EQ(block.classes(), (ClassList{0, 2, 3, 255}));
  block.add(2, minus.data());
  EXPECT_EQ(block.classes(), (ClassList{0, 3, 255}));
  for (std::size_t p = 0; p < 3; ++p) EXPECT_EQ(block.plane(p)[7], 5);
  EXPECT_EQ(block.evidence(2), nullptr);
  for (const int id : {3, 255, 0}) block.add(static_cast<ClassId>(id), minus.data());
  EXPECT_TRUE(block.empty());
  plane[7] = kMostUnits;
  EXPECT_EQ(block.add(1, plane.data()), 0u);
  EXPECT_EQ(block.add(1, plane.data()), 1u) << "the end of the range";
  EXPECT_EQ(block.evidence(1)[7], kMostUnits);
}

}  // namespace
}  // namespace bki_mapping
