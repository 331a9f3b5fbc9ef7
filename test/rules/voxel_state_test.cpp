// The state and the posterior of voxels, on cases worked out by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "bki_mapping/rules/voxel_state.h"
#include "other_value.h"
#include "reference/scenes.h"
#include "rules/rules_parameters.h"

namespace bki_mapping {
namespace {

constexpr double kPrior = 0.001;

/// A map of 3 classes with the given evidence (class, value) at one voxel of the block at index 0.
SemanticMap mapWith(const std::vector<std::pair<int, float>>& evidence, int offset) {
  SemanticMap map(GridGeometry(1.0), kPrior, 3);
  for (const auto& [label, value] : evidence) {
    EvidenceUnits plane[kBlockVoxels] = {};
    plane[offset] = unitsOf(static_cast<double>(value));
    map.getOrAllocate({{0, 0, 0}}).add(static_cast<ClassId>(label), plane);
  }
  return map;
}

VoxelView viewOf(const std::vector<std::pair<int, float>>& evidence) {
  const SemanticMap map = mapWith(evidence, 77);
  const VoxelView view = viewVoxel(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77);
  const VoxelView judged = viewWithoutEntropy(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77);
  EXPECT_EQ(judged.state, view.state);
  EXPECT_EQ(judged.label, view.label);
  EXPECT_EQ(judged.probability, view.probability);
  EXPECT_EQ(judged.variance, view.variance);
  EXPECT_EQ(judged.evidence, view.evidence);
  EXPECT_EQ(judged.occupancy, view.occupancy);
  EXPECT_EQ(judged.class_probability, view.class_probability);
  EXPECT_EQ(judged.entropy, 0.0f);
  return view;
}

/// Equation 13, for the class with the most evidence.
double occupancyOf(double best, double gain_times_free) {
  const double free = 0.05 * gain_times_free, something = 0.2 * kPrior + best + 0.03 * free;
  return something / (1.1 * something + 6 * kPrior + free);
}

TEST(VoxelState, OccupiedVoxel) {
  const VoxelView view = viewOf({{2, 0.75f}, {kFreeClass, 0.25f}});
  const double sum = 1.0 + 4 * kPrior, p = (0.75 + kPrior) / sum, f = (0.25 + kPrior) / sum, o = kPrior / sum;
  EXPECT_EQ(view.state, VoxelState::kOccupied);
  EXPECT_EQ(view.label, 2);
  EXPECT_NEAR(view.probability, p, 1e-6);
  EXPECT_NEAR(view.variance, p * (1 - p) / (sum + 1), 1e-6);
  EXPECT_NEAR(view.entropy, -p * std::log(p) - f * std::log(f) - 2 * o * std::log(o), 1e-6);
  EXPECT_NEAR(view.evidence, 1.0, 1e-6);
  EXPECT_NEAR(view.occupancy, occupancyOf(0.75, 0.25), 1e-6);
  const double square = (0.75 + kPrior) * (0.75 + kPrior);
  EXPECT_NEAR(view.class_probability, square / (square + 2 * kPrior * kPrior), 1e-6);
}

TEST(VoxelState, EvidenceForFreeLowersOccupancyAndNotTheClass) {
  const auto hit = viewOf({{1, 0.6f}, {2, 0.2f}}),
             crossed = viewOf({{1, 0.6f}, {2, 0.2f}, {kFreeClass, 0.4f}}),
             cleared = viewOf({{1, 0.6f}, {2, 0.2f}, {kFreeClass, 40.0f}});
  EXPECT_EQ(crossed.state, VoxelState::kOccupied);
  EXPECT_EQ(cleared.state, VoxelState::kFree);
  for (const VoxelView& view : {hit, crossed, cleared}) {
    EXPECT_NEAR(view.class_probability, 0.9, 2e-3) << "of class 1, in a free voxel, too";
  }
  EXPECT_NEAR(hit.occupancy, occupancyOf(0.6, 0.0), 1e-5);
  EXPECT_NEAR(crossed.occupancy, occupancyOf(0.6, 0.4), 1e-5);
  EXPECT_NEAR(cleared.occupancy, occupancyOf(0.6, 40.0), 1e-5);
  const auto only_free = viewOf({{kFreeClass, 1.0f}});
  EXPECT_NEAR(only_free.class_probability, 1.0 / 3.0, 1e-6) << "nothing says which class";
  EXPECT_NEAR(only_free.occupancy, occupancyOf(0.0, 1.0), 1e-6);
}

TEST(VoxelState, WrongLabelsHardlyLowerTheClass) {
  // Three labels in ten are wrong, and say anything else: the class is that of the other seven.
  EXPECT_GT(viewOf({{0, 0.15f}, {1, 0.7f}, {2, 0.15f}}).class_probability, 0.9f);
  // Two classes share the voxel: the larger part is that of a point in it.
  EXPECT_NEAR(viewOf({{0, 0.5f}, {1, 0.5f}}).class_probability, 0.5, 1e-6);
}

/// The evidence of a random voxel, and maps that have it.
struct RandomVoxel {
  std::vector<std::pair<int, float>> evidence;  ///< by class; may be empty
  std::array<double, 3> gains;
  double stands_after;     ///< evidence
  double remaining = 0.0;  ///< gain of what remains
  ClassSet fixed;

  explicit RandomVoxel(std::mt19937& random) {
    std::uniform_real_distribution<float> exponent(-6.0f, 6.0f);
    for (const int id : {0, 1, 2, int{kFreeClass}}) {
      if (random() % 3 != 0) evidence.emplace_back(id, std::exp(exponent(random)));
    }
    for (double& gain : gains) gain = std::exp(static_cast<double>(exponent(random)) / 3);
    stands_after = random() % 2 == 0 ? std::numeric_limits<double>::infinity() : 2.0;
  }
  VoxelView view() const {
    const SemanticMap map = mapWith(evidence, 77);
    StateRules rules = StateRules().withRemaining(remaining, fixed);
    for (std::size_t id = 0; id < gains.size(); ++id) {
      rules = rules.withFreeGain(static_cast<ClassId>(id), gains[id], stands_after);
    }
    return viewPoint(map, rules, map.geometry().voxelCentre(GridGeometry::voxelOf({{0, 0, 0}}, 77)));
  }
  /// The same with evidence added. @param id of a class, or kFreeClass.
  RandomVoxel with(int id, float more) const {
    RandomVoxel changed = *this;
    changed.evidence.emplace_back(id, more);
    return changed;
  }
  /// The gain of the voxel's likeliest class; 1 without one.
  double gain() const {
    std::pair<int, float> best = {kFreeClass, 0.0f};
    for (const auto& each : evidence)
      best = each.first != kFreeClass && each.second > best.second ? each : best;
    if (best.first == kFreeClass) return 1.0;
    const auto id = static_cast<ClassId>(best.first);
    const StateRules rules = StateRules().withFreeGain(id, gains[id], stands_after);
    return static_cast<double>(rules.freeGain(id, best.second));
  }
};

TEST(VoxelState, StatesAgreeWithTheOccupancy) {
  std::mt19937 random(3);
  int occupied = 0, free = 0, above = 0;
  for (int n = 0; n < 2000; ++n) {
    const RandomVoxel voxel(random);
    const VoxelView view = voxel.view();
    if (view.state == VoxelState::kUnknown) continue;
    const double threshold = 1.0 / (1.1 + 0.05 / (std::min(voxel.gain(), 1.0) + 0.0015));
    if (view.state == VoxelState::kFree) {
      EXPECT_LT(static_cast<double>(view.occupancy), threshold + 1e-6) << n;
      ++free;
      continue;
    }
    // Where hits are far above the prior, the converse holds.
    const bool sure = static_cast<double>(view.evidence) > 1e4 * kPrior;
    if (sure) {
      EXPECT_GT(static_cast<double>(view.occupancy), 0.99 * threshold) << n;
    }
    above += sure;
    ++occupied;
  }
  EXPECT_GT(occupied, 300);
  EXPECT_GT(free, 300);
  EXPECT_GT(above, 200);
}

/// The evidence of a class, as it was added and rounded.
double evidenceOf(const RandomVoxel& voxel, int id) {
  double sum = 0.0;
  for (const auto& [other, value] : voxel.evidence)
    if (other == id) sum += static_cast<double>(kEvidenceUnit) * unitsOf(static_cast<double>(value));
  return sum;
}

TEST(VoxelState, WhatCannotMoveRemains) {
  // Equations 11, 12 and 12a, written down plainly.
  std::mt19937 random(5);
  int remained = 0, cleared = 0;
  for (int n = 0; n < 50000; ++n) {
    RandomVoxel voxel(random);
    voxel.remaining = n % 4 == 0 ? 0.0 : std::exp2(static_cast<double>(random() % 9) - 6.0);
    for (std::size_t id = 0; id < 3; ++id) {
      voxel.fixed[id] = random() % 2 == 0;
      if (!voxel.fixed[id]) voxel.gains[id] *= 100.0;
    }
    const double free = evidenceOf(voxel, kFreeClass);
    int likeliest = 0, fixed = -1;
    for (int id = 0; id < 3; ++id) {
      if (evidenceOf(voxel, id) > evidenceOf(voxel, likeliest)) likeliest = id;
      const bool more = fixed < 0 || evidenceOf(voxel, id) > evidenceOf(voxel, fixed);
      if (voxel.fixed[static_cast<std::size_t>(id)] && more) fixed = id;
    }
    int label = kFreeClass;
    if (evidenceOf(voxel, likeliest) == 0.0) {
      if (free == 0.0) continue;
    } else if (evidenceOf(voxel, likeliest) >= voxel.gain() * free) {
      label = likeliest;
    } else if (fixed >= 0 && !voxel.fixed[static_cast<std::size_t>(likeliest)] && voxel.remaining > 0.0 &&
               4.0 * evidenceOf(voxel, fixed) >= evidenceOf(voxel, likeliest) &&
               evidenceOf(voxel, fixed) >= voxel.remaining * free) {
      label = fixed;
      ++remained;
    } else {
      ++cleared;
    }
    const VoxelView view = voxel.view();
    EXPECT_EQ(view.label, label) << n;
    EXPECT_EQ(view.state, label == kFreeClass ? VoxelState::kFree : VoxelState::kOccupied) << n;
    if (label != fixed || label == likeliest || label == kFreeClass) continue;
    double squares = 0.0, sum = free + 4 * kPrior;
    for (int id = 0; id < 3; ++id) {
      squares += std::pow(kPrior + evidenceOf(voxel, id), 2);
      sum += evidenceOf(voxel, id);
    }
    const double alpha = kPrior + evidenceOf(voxel, fixed);
    EXPECT_NEAR(view.class_probability, alpha * alpha / squares, 1e-6) << n;
    EXPECT_NEAR(view.probability, alpha / sum, 1e-6) << n;
    EXPECT_NEAR(view.occupancy, occupancyOf(evidenceOf(voxel, fixed), std::max(1.0, voxel.remaining) * free),
                1e-6);
  }
  EXPECT_GT(remained, 200);
  EXPECT_GT(cleared, 300);
}

TEST(VoxelState, WhatRemainsIsAtLeastAQuarter) {
  const auto state = [](EvidenceUnits moved, EvidenceUnits fixed) {
    SemanticMap map(GridGeometry(1.0), kPrior, 3);
    for (const auto& [id, units] : {std::pair{1, moved}, {2, fixed}, {int{kFreeClass}, 1}}) {
      EvidenceUnits plane[kBlockVoxels] = {};
      plane[77] = units;
      map.getOrAllocate({{0, 0, 0}}).add(static_cast<ClassId>(id), plane);
    }
    const StateRules rules = StateRules().withFreeGain(1, 1e12).withRemaining(1e-6, ClassSet(0b100));
    return viewVoxel(map, rules, {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77).state;
  };
  for (const EvidenceUnits quarter : {1, 2, 1000, 1 << 28}) {
    EXPECT_EQ(state(4 * (quarter - 1) + 3, quarter), VoxelState::kOccupied) << quarter;
    if (quarter == 1 << 28) break;  // four times as much is out of range
    EXPECT_EQ(state(4 * quarter, quarter), VoxelState::kOccupied) << quarter;
    EXPECT_EQ(state(4 * quarter + 1, quarter), VoxelState::kFree) << quarter;
  }
}

TEST(VoxelState, ProbabilitiesGrowWithTheirEvidence) {
  std::mt19937 random(4);
  int labelled = 0;
  for (int n = 0; n < 1000; ++n) {
    RandomVoxel voxel(random);
    voxel.stands_after = std::numeric_limits<double>::infinity();  // hits that lower a gain count twice
    const VoxelView view = voxel.view(), crossed = voxel.with(kFreeClass, 0.5f).view();
    EXPECT_LE(crossed.occupancy, view.occupancy) << n;
    EXPECT_EQ(crossed.class_probability, view.class_probability) << n;
    EXPECT_GE(view.class_probability, 1.0f / 3 - 1e-6f) << n;
    EXPECT_LE(view.class_probability, 1.0f) << n;
    if (view.state != VoxelState::kOccupied) continue;
    ++labelled;
    const VoxelView hit = voxel.with(view.label, 0.5f).view();
    EXPECT_EQ(hit.label, view.label);
    EXPECT_GE(hit.occupancy, view.occupancy) << n;
    EXPECT_GE(hit.class_probability, view.class_probability) << n;
    const VoxelView doubted = voxel.with((view.label + 1) % 3, 1e-4f).view();
    if (doubted.label == view.label) {
      EXPECT_LE(doubted.class_probability, view.class_probability) << n;
    }
  }
  EXPECT_GT(labelled, 300);
}

TEST(VoxelState, ProbabilitiesDoNotDependOnTheUnitOfEvidence) {
  const auto view = [](float unit) {
    SemanticMap map(GridGeometry(1.0), static_cast<double>(unit) * kPrior, 3);
    for (const auto& [id, value] : {std::pair{1, 0.5f}, {2, 0.25f}, {int{kFreeClass}, 0.75f}}) {
      EvidenceUnits plane[kBlockVoxels] = {};
      plane[77] = unitsOf(static_cast<double>(unit * value));
      map.getOrAllocate({{0, 0, 0}}).add(static_cast<ClassId>(id), plane);
    }
    return viewVoxel(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77);
  };
  EXPECT_FLOAT_EQ(view(64.0f).occupancy, view(1.0f).occupancy);
  EXPECT_FLOAT_EQ(view(64.0f).class_probability, view(1.0f).class_probability);
}

TEST(VoxelState, TheLastUnitDecides) {
  // Floats hold 24 bits: these numbers of units are equal as floats.
  const auto viewOfUnits = [](EvidenceUnits one, EvidenceUnits two, EvidenceUnits free) {
    SemanticMap map(GridGeometry(1.0), kPrior, 3);
    const std::pair<ClassId, EvidenceUnits> all[] = {{1, one}, {2, two}, {kFreeClass, free}};
    for (const auto& [id, units] : all) {
      EvidenceUnits plane[kBlockVoxels] = {};
      plane[77] = units;
      map.getOrAllocate({{0, 0, 0}}).add(id, plane);
    }
    return viewVoxel(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77);
  };
  constexpr EvidenceUnits kMany = 1 << 30;
  EXPECT_EQ(viewOfUnits(kMany, kMany + 1, 0).label, 2);
  EXPECT_EQ(viewOfUnits(kMany + 1, kMany, 0).label, 1);
  EXPECT_EQ(viewOfUnits(kMany, kMany, kMany).state, VoxelState::kOccupied);
  EXPECT_EQ(viewOfUnits(kMany, kMany, kMany + 1).state, VoxelState::kFree);
  EXPECT_EQ(viewOfUnits(-5, -5, -5).state, VoxelState::kUnknown) << "taken back without having been added";
}

TEST(VoxelState, FreeVoxelAndTies) {
  EXPECT_EQ(viewOf({{1, 0.1f}, {kFreeClass, 0.2f}}).state, VoxelState::kFree);
  EXPECT_EQ(viewOf({{1, 0.1f}, {kFreeClass, 0.2f}}).label, kFreeClass);
  EXPECT_EQ(viewOf({{1, 0.2f}, {kFreeClass, 0.2f}}).state, VoxelState::kOccupied);  // a tie is occupied
  EXPECT_EQ(viewOf({{2, 0.2f}, {1, 0.2f}}).label, 1);                               // the smaller id
  EXPECT_EQ(viewOf({{1, 0.2f}, {2, 0.2f}}).label, 1);
}

TEST(VoxelState, GainsDecideTheStateAndLeaveThePosterior) {
  const SemanticMap map = mapWith({{1, 0.375f}, {2, 0.25f}, {kFreeClass, 0.5f}}, 77);
  StateRules rules;
  const auto view = [&] { return viewVoxel(map, rules, {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77); };
  const double sum = 1.125 + 4 * kPrior;
  EXPECT_EQ(view().state, VoxelState::kFree);
  EXPECT_NEAR(view().probability, (0.5 + kPrior) / sum, 1e-6);
  rules = rules.withFreeGain(1, 0.1);
  EXPECT_EQ(view().state, VoxelState::kOccupied);
  EXPECT_EQ(view().label, 1);
  EXPECT_NEAR(view().probability, (0.375 + kPrior) / sum, 1e-6);
  EXPECT_NEAR(view().occupancy, occupancyOf(0.375, 0.5), 1e-6) << "a gain below 1 is a choice, not a fact";
  rules = rules.withFreeGain(1, 4.0);
  EXPECT_NEAR(view().occupancy, occupancyOf(0.375, 4.0 * 0.5), 1e-6) << "one above 1 says that things move";
  rules = rules.withFreeGain(1, 1.0);
  rules = rules.withFreeGain(2, 0.1);  // not the class with the most evidence
  EXPECT_EQ(view().state, VoxelState::kFree);
}

TEST(VoxelState, WhatStandsOutweighsTheGain) {
  // With a gain of 4, free wins with over a quarter of the hits' evidence, until the thing stands.
  const auto state = [](float hits, float free, double stands_after) {
    const SemanticMap map = mapWith({{1, hits}, {kFreeClass, free}}, 77);
    const StateRules rules = StateRules().withFreeGain(1, 4.0, stands_after);
    return viewVoxel(map, rules, {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77).state;
  };
  constexpr double kNever = std::numeric_limits<double>::infinity();
  EXPECT_EQ(state(0.2f, 0.1f, kNever), VoxelState::kFree);
  EXPECT_EQ(state(0.2f, 0.1f, 1.0), VoxelState::kFree) << "one hit: it may have been passing";
  EXPECT_EQ(state(4.0f, 2.0f, kNever), VoxelState::kFree);
  EXPECT_EQ(state(4.0f, 2.0f, 4.0), VoxelState::kOccupied) << "it stands";
  EXPECT_EQ(state(4.0f, 2.0f, 4.01), VoxelState::kFree);
  EXPECT_EQ(state(4.0f, 4.5f, 1.0), VoxelState::kFree) << "until it has been gone for as long";
}

TEST(VoxelState, WhereLooksDecideSpaceThatWasLongFreeCountsForSoMuch) {
  const StateRules sum = StateRules().withHitOfScan(0.01), latest = sum.withLatest(true);
  const auto stateOf = [](const StateRules& rules, float hits, bool has_looks = true) {
    SemanticMap map = mapWith({{1, hits}, {kFreeClass, 3000.0f}}, 77);
    Look::Voxels beside;
    beside.set(78);
    if (has_looks) map.getOrAllocate({{0, 0, 0}}).looks().add(Look(100, beside, {}, {}));
    const Block& block = *map.find({{0, 0, 0}});
    BlockView whole;
    readBlock(map, rules, {{0, 0, 0}}, block, BlockFields::kStates, whole);
    const VoxelView view = viewVoxel(map, rules, {{0, 0, 0}}, block, 77);
    EXPECT_NEAR(view.evidence, 3000.0 + static_cast<double>(hits), 1e-3)
        << "the posterior is that of the sum";
    const VoxelState state = view.state;
    EXPECT_EQ(whole.state[77], state);
    return state;
  };
  EXPECT_EQ(stateOf(latest, 3.001f), VoxelState::kOccupied) << "hit in 300 scans";
  EXPECT_EQ(stateOf(latest, 2.999f), VoxelState::kFree);
  EXPECT_EQ(stateOf(latest, 3.001f, false), VoxelState::kFree) << "no looks could clear it";
  EXPECT_EQ(stateOf(sum, 3.001f), VoxelState::kFree);
  EXPECT_EQ(stateOf(StateRules().withLatest(true), 3.001f), VoxelState::kFree)
      << "no scan's evidence is known";
}

TEST(VoxelState, NeighboursKeepWhatIsInDoubtByAllTheEvidenceForFree) {
  const StateRules rules =
      StateRules().withHitOfScan(0.01).withLatest(true).withNeighbourhood(1.0, ClassSet().set(1));
  const auto stateOf = [&](float free) {
    SemanticMap map = mapWith({{1, 0.2f}, {kFreeClass, free}}, 77);
    Block& block = map.getOrAllocate({{0, 0, 0}});
    EvidenceUnits kept[kBlockVoxels] = {};
    kept[78] = unitsOf(5.0);
    block.add(1, kept);
    Look::Voxels elsewhere;
    elsewhere.set(400);
    block.looks().add(Look(100, elsewhere, {}, {}));
    BlockView whole;
    readBlock(map, rules, {{0, 0, 0}}, block, BlockFields::kStates, whole);
    EXPECT_EQ(whole.state[77], viewVoxel(map, rules, {{0, 0, 0}}, block, 77).state);
    return whole.state[77];
  };
  EXPECT_EQ(stateOf(3.9f), VoxelState::kOccupied) << "a hit outweighs a twentieth of it";
  EXPECT_EQ(stateOf(3000.0f), VoxelState::kFree) << "also beyond that of 300 scans with hits";
}

TEST(VoxelState, WhatRemainsIsAskedOfAllTheEvidenceForFree) {
  // A truck of which some scans said building has left.
  SemanticMap map = mapWith({{1, 1.2f}, {2, 0.4f}, {kFreeClass, 300.0f}}, 77);
  Look::Voxels voxel;
  voxel.set(77);
  Looks& looks = map.getOrAllocate({{0, 0, 0}}).looks();
  looks.add(Look(100, {}, {}, voxel));
  for (std::uint64_t tick = 101; tick < 110; ++tick) looks.add(Look(tick, {}, voxel, {}));
  const StateRules rules = StateRules()
                               .withHitOfScan(0.01)
                               .withLatest(true)
                               .withFreeGain(1, 20.0, 0.05)
                               .withFreeGain(2, 0.0)
                               .withRemaining(0.1, ClassSet().set(2));
  const Block& block = *map.find({{0, 0, 0}});
  EXPECT_EQ(viewVoxel(map, rules, {{0, 0, 0}}, block, 77).state, VoxelState::kFree);
  BlockView whole;
  readBlock(map, rules, {{0, 0, 0}}, block, BlockFields::kStates, whole);
  EXPECT_EQ(whole.state[77], VoxelState::kFree);
}

TEST(VoxelState, GainsWithoutEvidenceForFreeMakeNothingFree) {
  const SemanticMap map = mapWith({{1, 0.4f}}, 77);
  const StateRules rules = StateRules().withFreeGain(1, 1000.0);
  EXPECT_EQ(viewVoxel(map, rules, {{0, 0, 0}}, *map.find({{0, 0, 0}}), 77).state, VoxelState::kOccupied);
}

TEST(VoxelState, UnknownVoxelHasThePrior) {
  const SemanticMap map = mapWith({{1, 1.0f}}, 0);
  for (const VoxelView& view : {viewVoxel(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 5),
                                viewPoint(map, StateRules(), {100.0, 0.0, 0.0})}) {
    EXPECT_EQ(view.state, VoxelState::kUnknown);
    EXPECT_NEAR(view.probability, 0.25, 1e-6);
    EXPECT_NEAR(view.occupancy, occupancyOf(0.0, 0.0), 1e-6);
    EXPECT_NEAR(view.class_probability, 1.0 / 3.0, 1e-6);
    EXPECT_NEAR(view.entropy, std::log(4.0), 1e-6);
    EXPECT_EQ(view.evidence, 0.0f);
  }
}

TEST(VoxelState, OccludedOnlyWithoutEvidence) {
  SemanticMap map = mapWith({{1, 1.0f}}, 0);
  Block::Occlusion marks;
  marks.set(0).set(1);
  map.getOrAllocate({{0, 0, 0}}).setOcclusion(marks);
  EXPECT_EQ(viewVoxel(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 0).state,
            VoxelState::kOccupied);
  EXPECT_EQ(viewVoxel(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 1).state,
            VoxelState::kOccluded);
  EXPECT_EQ(viewVoxel(map, StateRules(), {{0, 0, 0}}, *map.find({{0, 0, 0}}), 2).state, VoxelState::kUnknown);
}

TEST(StateRules, OfOtherSettingsDecideOtherwise) {
  RulesConfig config;
  config.enabled = true;
  const auto rulesOf = [](const RulesConfig& rules) {
    return StateRules(rules, *reference::smallTable(), 0.3);
  };
  EXPECT_TRUE(rulesOf(config).decidesAs(rulesOf(config)));
  for (const auto& p : rulesParameters()) {
    RulesConfig other = config;
    p.set(other, otherValue(p, other));
    EXPECT_FALSE(rulesOf(config).decidesAs(rulesOf(other))) << p.name;
  }
}

TEST(VoxelState, VisitsKnownVoxelsInSortedOrder) {
  SemanticMap map(GridGeometry(1.0), kPrior, 3);
  EvidenceUnits plane[kBlockVoxels] = {};
  plane[3] = unitsOf(1.0);
  for (const int x : {4, -2, 0}) map.getOrAllocate({{x, 0, 0}}).add(0, plane);
  std::vector<int> seen;
  forEachKnownVoxel(map, StateRules(), [&](const VoxelIndex& v, const VoxelView&) { seen.push_back(v.x); });
  EXPECT_EQ(seen, (std::vector<int>{-13, 3, 35}));
}

}  // namespace
}  // namespace bki_mapping
