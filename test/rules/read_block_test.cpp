// A block that is read at once equals its voxels, one by one, on every instruction set.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <ostream>
#include <random>
#include <vector>

#include "bki_mapping/rules/map_snapshot.h"
#include "rules/state_kernels.h"
#include "simd/instruction_sets.h"
#include "simd/vec_generic.h"

#include "rules/vec_log_inl.h"

namespace bki_mapping {
namespace {

constexpr float kError = 1e-6f;  // what voxel_state.h promises

/// What a random map is made of.
struct Kind {
  std::size_t classes;  ///< in the class table
  int planes;           ///< of the block, at most
  double prior;
  enum Evidence { kPlain, kSparse, kTies, kExtreme } evidence;  ///< kSparse: mostly whole rows of zeros
  bool gains, stays, occlusion;
  bool neighbours = false;  ///< blocks around, and a ratio of evidence
};

EvidenceUnits randomUnits(Kind::Evidence kind, std::mt19937& random) {
  constexpr EvidenceUnits kEdges[] = {
      0, 0, 1, -1, kMostUnits, -kMostUnits, kMostUnits - 1, 1 << 30, 1 << 24, (1 << 24) + 1};
  std::uniform_real_distribution<double> exponent(0.0, 25.0);
  switch (kind) {
    case Kind::kTies:
      return static_cast<EvidenceUnits>(random() % 3) << 16;
    case Kind::kExtreme:
      if (random() % 2 == 0) return kEdges[random() % std::size(kEdges)];
      return static_cast<EvidenceUnits>(random() % 2 == 0 ? -std::exp2(exponent(random))
                                                          : std::exp2(exponent(random)));
    default:
      return random() % 3 == 0 ? 0 : static_cast<EvidenceUnits>(std::exp2(exponent(random)));
  }
}

void fillBlock(const Kind& kind, std::mt19937& random, Block& block) {
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  for (int p = 0; p < kind.planes; ++p) {
    const std::size_t n = random() % (kind.classes + 1);
    const auto id = n == kind.classes ? kFreeClass : static_cast<ClassId>(n);
    for (EvidenceUnits& units : plane) units = randomUnits(kind.evidence, random);
    constexpr std::size_t kRow = 16;  // at least a vector
    for (std::size_t v = 0; kind.evidence == Kind::kSparse && v < plane.size(); v += kRow) {
      if (random() % 4 != 0) std::fill_n(plane.data() + v, kRow, 0);
    }
    block.change(id, [&](EvidenceUnits* to) {
      std::copy(plane.begin(), plane.end(), to);
      return true;
    });
  }
}

MapSnapshot randomMap(const Kind& kind, std::mt19937& random) {
  StateRules rules;
  SemanticMap map(GridGeometry(0.3), kind.prior, kind.classes);
  Block& block = map.getOrAllocate({{0, 0, 0}});
  fillBlock(kind, random, block);
  for (int n = 0; kind.neighbours && n < 27; ++n) {
    const BlockIndex index{{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1}};
    if (n != 13 && random() % 4 != 0) fillBlock(kind, random, map.getOrAllocate(index));
  }
  if (kind.neighbours) {
    ClassSet asking;
    for (std::size_t id = 0; id < kind.classes; ++id) asking[id] = random() % 2 == 0;
    rules =
        rules.withNeighbourhood(std::exp2(static_cast<double>(random() % 5) - 2.0), asking, random() % 2 == 0,
                                1 + static_cast<int>(random() % StateRules::kMostReach));
  }
  if (kind.neighbours && random() % 2 == 0) {
    rules = rules.withLatest(true);
    for (const auto& [index, at] : map.entries()) {
      Looks& looks = map.getOrAllocate(index).looks();
      for (std::uint64_t tick = 1000; tick < 1000 + random() % 40; tick += 1 + random() % 3) {
        Look::Voxels seen[3];
        for (std::size_t v = 0; v < kBlockVoxels; ++v) {
          const std::size_t sight = random() % 5;
          if (sight < 3) seen[sight][v] = true;
        }
        looks.add(Look(tick, seen[0], seen[1], seen[2]));
      }
    }
  }
  if (kind.occlusion) {
    Block::Occlusion marks;
    for (std::size_t v = 0; v < kBlockVoxels; ++v) marks[v] = random() % 2 == 0;
    block.setOcclusion(marks);
  }
  constexpr double kGains[] = {1.0, 0.1, 0.5, 2.0, 8.0, 1e-6, 1e6, 1e300};
  for (std::size_t id = 0; kind.gains && id < kind.classes; ++id) {
    const double gain = kGains[random() % std::size(kGains)];
    const double stands_after = std::exp2(static_cast<double>(random() % 20) - 10.0);
    if (kind.stays && random() % 4 == 0) {
      rules = rules.withConfirmation(static_cast<ClassId>(id), gain, stands_after);
      continue;
    }
    rules = kind.stays ? rules.withFreeGain(static_cast<ClassId>(id), gain, stands_after)
                       : rules.withFreeGain(static_cast<ClassId>(id), gain);
  }
  if (kind.gains) {
    ClassSet fixed;
    for (std::size_t id = 0; id < kind.classes; ++id) fixed[id] = random() % 2 == 0;
    rules = rules.withRemaining(random() % 4 == 0 ? 0.0 : kGains[random() % std::size(kGains)], fixed);
  }
  if (kind.stays) rules = rules.withHitOfScan(std::exp2(static_cast<double>(random() % 20) - 11.0));
  return {std::move(map), rules};
}

constexpr BlockIndex kOrigin{{0, 0, 0}};

/// Of a voxel, for messages.
struct Where {
  const std::string& set;
  const std::string& what;
  int offset;
};
std::ostream& operator<<(std::ostream& out, const Where& where) {
  return out << where.set << ", " << where.what << ", voxel " << where.offset;
}

void expectNear(float value, float expected, const char* field, const Where& where) {
  ASSERT_NEAR(value, expected, kError * std::abs(expected)) << field << ", " << where;
}

/// The voxels of the map's block, one by one.
std::vector<VoxelView> oneByOne(const SemanticMap& map, const StateRules& rules) {
  std::vector<VoxelView> views;
  for (int offset = 0; offset < kBlockVoxels; ++offset)
    views.push_back(viewVoxel(map, rules, kOrigin, *map.find(kOrigin), offset));
  return views;
}

/// Compares every voxel of the map's block, read at once, with what is expected.
void compare(const SemanticMap& map, const StateRules& rules, const std::vector<VoxelView>& expected_views,
             const std::string& set, const std::string& what) {
  const Block& block = *map.find(kOrigin);
  BlockView view, states, posterior;
  std::memset(static_cast<void*>(&view), 0x55, sizeof(view));
  states = posterior = view;
  const StateKernels& kernels = stateKernelsFor(set);
  readBlock(kernels, map, rules, kOrigin, block, BlockFields::kAll, view);
  readBlock(kernels, map, rules, kOrigin, block, BlockFields::kStates, states);
  readBlock(kernels, map, rules, kOrigin, block, BlockFields::kAllButEntropy, posterior);
  EXPECT_EQ(states.state, view.state) << set << ", " << what;
  EXPECT_EQ(states.label, view.label) << set << ", " << what;
  posterior.entropy = view.entropy;
  EXPECT_EQ(std::memcmp(&posterior, &view, sizeof(view)), 0) << set << ", " << what;
  for (int offset = 0; offset < kBlockVoxels; ++offset) {
    const VoxelView got = view.at(offset), &expected = expected_views[static_cast<std::size_t>(offset)];
    const Where where{set, what, offset};
    ASSERT_EQ(got.state, expected.state) << where;
    ASSERT_EQ(got.label, expected.label) << where;
    expectNear(got.probability, expected.probability, "probability", where);
    expectNear(got.variance, expected.variance, "variance", where);
    expectNear(got.occupancy, expected.occupancy, "occupancy", where);
    expectNear(got.class_probability, expected.class_probability, "class_probability", where);
    expectNear(got.entropy, expected.entropy, "entropy", where);
    expectNear(got.evidence, expected.evidence, "evidence", where);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(VecLog, ErrsByLessThanItsBound) {
  const auto expectClose = [](FloatVec got, float x, double expected) {
    for (int lane = 0; lane < kLanes; ++lane) {
      ASSERT_NEAR(static_cast<double>(got[lane]), expected,
                  static_cast<double>(kLogError) * std::abs(expected))
          << x;
    }
  };
  for (float x = 1e-37f; x < 1e37f; x *= 1.0003f) {
    if (x <= 0.5f || x >= 2.0f) expectClose(log(Set(x)), x, std::log(static_cast<double>(x)));
    expectClose(logOnePlus(Set(x)), x, std::log1p(static_cast<double>(x)));
    if (HasFatalFailure()) return;
  }
  expectClose(logOnePlus(FloatVec{}), 0.0f, 0.0);
}

TEST(ReadBlock, EqualsItsVoxelsOneByOne) {
  std::mt19937 random(8);
  int n = 0;
  for (const auto evidence : {Kind::kPlain, Kind::kSparse, Kind::kTies, Kind::kExtreme}) {
    for (const bool gains : {false, true}) {
      for (const bool stays : {false, true}) {
        for (const double prior : {0.001, 1e-6, 1.0, 1e9}) {
          for (const auto& [classes, planes] : {std::pair{3, 0}, {1, 2}, {3, 6}, {20, 8}, {254, 1200}}) {
            const Kind kind{
                static_cast<std::size_t>(classes), planes, prior, evidence, gains, stays, n % 2 == 0};
            const MapSnapshot made = randomMap(kind, random);
            const std::vector<VoxelView> expected = oneByOne(made.map, made.rules);
            for (const std::string& set : instructionSets())
              compare(made.map, made.rules, expected, set, "map " + std::to_string(n));
            if (HasFatalFailure()) return;
            ++n;
          }
        }
      }
    }
  }
}

TEST(ReadBlock, EqualsItsVoxelsOneByOneAmongOtherBlocks) {
  std::mt19937 random(9);
  int n = 0;
  for (const auto evidence : {Kind::kPlain, Kind::kSparse, Kind::kTies, Kind::kExtreme}) {
    for (const bool stays : {false, true}) {
      for (const double prior : {0.001, 1.0}) {
        for (const auto& [classes, planes] : {std::pair{1, 2}, {3, 6}, {20, 8}}) {
          const Kind kind{
              static_cast<std::size_t>(classes), planes, prior, evidence, true, stays, n % 2 == 0, true};
          const MapSnapshot made = randomMap(kind, random);
          const std::vector<VoxelView> expected = oneByOne(made.map, made.rules);
          for (const std::string& set : instructionSets())
            compare(made.map, made.rules, expected, set, "map " + std::to_string(n));
          if (HasFatalFailure()) return;
          ++n;
        }
      }
    }
  }
}

TEST(ReadBlock, DecidesByTheLastUnit) {
  for (const std::string& set : instructionSets()) {
    for (const double gain : {1.0, 0.5, 2.0, 0.1, 4.0}) {
      for (const int round : {0, 1}) {
        SemanticMap map(GridGeometry(0.3), 0.001, 3);
        // The class holds the voxel itself, or remains of another, with the same gain.
        const bool remains = round == 1;
        StateRules rules = StateRules().withFreeGain(remains ? 0 : 1, remains ? 1e6 : gain);
        if (remains) rules = rules.withRemaining(gain, ClassSet(0b10));
        Block& block = map.getOrAllocate({{0, 0, 0}});
        std::vector<EvidenceUnits> hits(kBlockVoxels), free(kBlockVoxels);
        for (int v = 0; v < kBlockVoxels; ++v) {
          const auto at = static_cast<std::size_t>(v);
          free[at] = 1 << (v % 29);
          hits[at] = static_cast<EvidenceUnits>(std::lround(gain * free[at])) + v / 29 % 3 - 1;
        }
        block.add(1, hits.data());
        block.add(kFreeClass, free.data());
        for (EvidenceUnits& units : hits) ++units;
        if (remains) block.add(0, hits.data());
        compare(map, rules, oneByOne(map, rules), set, "gain " + std::to_string(gain));
      }
    }
  }
}

TEST(ReadBlock, WhatRemainsIsAQuarterOfWhatHasLeft) {
  for (const std::string& set : instructionSets()) {
    SemanticMap map(GridGeometry(0.3), 0.001, 3);
    const StateRules rules = StateRules().withFreeGain(0, 1e12).withRemaining(1e-6, ClassSet(0b10));
    std::vector<EvidenceUnits> left(kBlockVoxels), remains(kBlockVoxels);
    const std::vector<EvidenceUnits> free(kBlockVoxels, 1);
    for (int v = 0; v < kBlockVoxels; ++v) {
      const auto at = static_cast<std::size_t>(v);
      remains[at] = 1 << (v % 28);
      left[at] = 4 * remains[at] + v / 28 % 7 - 3;
    }
    Block& block = map.getOrAllocate({{0, 0, 0}});
    block.add(0, left.data());
    block.add(1, remains.data());
    block.add(kFreeClass, free.data());
    BlockView view;
    readBlock(stateKernelsFor(set), map, rules, {{0, 0, 0}}, block, BlockFields::kStates, view);
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      const bool holds = left[v] <= 4 * remains[v];
      EXPECT_EQ(view.label[v], holds ? 1 : kFreeClass) << set << ' ' << left[v] << ' ' << remains[v];
    }
  }
}

TEST(ReadBlock, ATinyPriorIsANumberStill) {
  for (const std::string& set : instructionSets()) {
    SemanticMap map(GridGeometry(0.3), 1e-300, 3);
    std::vector<EvidenceUnits> hits(kBlockVoxels, 0);
    hits[0] = 1;
    map.getOrAllocate({{0, 0, 0}}).add(1, hits.data());
    BlockView view;
    readBlock(stateKernelsFor(set), map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), BlockFields::kAll,
              view);
    for (std::size_t v = 0; v < 2; ++v) {
      EXPECT_NEAR(view.probability[v], v == 0 ? 1.0 : 0.25, 1e-6);
      EXPECT_NEAR(view.occupancy[v], v == 0 ? 1.0 / 1.1 : 0.2 / (1.1 * 0.2 + 6.0), 1e-6);
      EXPECT_NEAR(view.class_probability[v], v == 0 ? 1.0 : 1.0 / 3.0, 1e-6);
      EXPECT_NEAR(view.entropy[v], v == 0 ? 0.0 : std::log(4.0), 1e-6);
    }
  }
}

}  // namespace
}  // namespace bki_mapping
