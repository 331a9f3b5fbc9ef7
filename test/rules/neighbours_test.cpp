// Equation 12b, by looking at every voxel around.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bki_mapping/rules/voxel_state.h"
#include "rules/neighbourhood.h"

namespace bki_mapping {
namespace {

constexpr ClassId kRoad = 0, kCar = 1, kTruck = 2, kWalker = 3;
constexpr double kPrior = 0.001;
constexpr double kGain = 20.0, kStandsAfter = 1.6, kRatio = 1.5, kRemaining = 0.2;
constexpr double kMost = 4.0;  // evidence of one voxel counts up to this

/// The evidence for a class in a voxel.
double evidenceFor(const SemanticMap& map, const VoxelIndex& voxel, ClassId id) {
  const Block* const block = map.find(GridGeometry::blockOf(voxel));
  const EvidenceUnits* const plane = block ? block->evidence(id) : nullptr;
  return plane ? static_cast<double>(evidenceOf(plane[GridGeometry::offsetInBlock(voxel)])) : 0.0;
}

ClassId likeliest(const SemanticMap& map, const VoxelIndex& voxel) {
  ClassId best = kRoad;
  for (const ClassId id : {kCar, kTruck, kWalker}) {
    if (evidenceFor(map, voxel, id) > evidenceFor(map, voxel, best)) best = id;
  }
  return best;
}

bool asks(ClassId id) {
  return id == kCar || id == kTruck;
}

/// Equations 11 and 12.
bool holds(const SemanticMap& map, const VoxelIndex& voxel, ClassId id) {
  const double hits = evidenceFor(map, voxel, id), gain = id == kRoad || hits >= kStandsAfter ? 1.0 : kGain;
  return hits >= gain * evidenceFor(map, voxel, kFreeClass);
}

/// The class that occupies a voxel, from the definitions; kFreeClass if none does.
/// @param asks_below whether voxels below are asked, too.
/// @param reach of the neighbourhood [voxels].
ClassId slowLabel(const SemanticMap& map, const VoxelIndex& voxel, bool asks_below, int reach) {
  const double free = evidenceFor(map, voxel, kFreeClass), road = evidenceFor(map, voxel, kRoad);
  const ClassId best = likeliest(map, voxel);
  if (evidenceFor(map, voxel, best) == 0.0) return kFreeClass;
  double kept = 0.0, cleared = 0.0, keeping = 0.0;
  for (int z = asks_below ? -reach : 0; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const VoxelIndex at{{voxel.x + x, voxel.y + y, voxel.z + z}};
        const ClassId of_other = likeliest(map, at);
        if (!asks(of_other)) continue;
        const double evidence = std::min(evidenceFor(map, at, of_other), kMost);
        (holds(map, at, of_other) ? kept : cleared) += evidence;
        keeping += evidence > 0.0 && holds(map, at, of_other);
      }
    }
  }
  bool is_kept = holds(map, voxel, best);
  if (asks(best)) {
    const double own = std::min(evidenceFor(map, voxel, best), kMost);
    const bool is_doubtful = 20.0 * evidenceFor(map, voxel, best) >= free;
    is_kept = kept >= kRatio * cleared && (is_kept || (is_doubtful && 4.0 * keeping * own >= kept));
  }
  if (is_kept) return best;
  if (best == kRoad) return kFreeClass;
  return road >= kRemaining * free && 4.0 * road >= evidenceFor(map, voxel, best) ? kRoad : kFreeClass;
}

StateRules rulesOfAll(bool asks_below = true, int reach = 2) {
  StateRules rules = StateRules()
                         .withHitOfScan(kMost / StateRules::kMostVotes)
                         .withNeighbourhood(kRatio, ClassSet().set(kCar).set(kTruck), asks_below, reach)
                         .withRemaining(kRemaining, ClassSet(0b1));
  for (const ClassId id : {kCar, kTruck, kWalker}) rules = rules.withFreeGain(id, kGain, kStandsAfter);
  return rules;
}

/// A map of 3 x 3 x 2 blocks of which some are missing: clusters of all classes, some of them crossed.
SemanticMap randomMap(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  SemanticMap map(GridGeometry(0.3), kPrior, 4);
  for (int z = -1; z < 1; ++z) {
    for (int y = -1; y < 2; ++y) {
      for (int x = -1; x < 2; ++x) {
        if (random() % 8 == 0) continue;
        Block& block = map.getOrAllocate({{x, y, z}});
        for (const ClassId id : {kRoad, kCar, kTruck, kWalker, kFreeClass}) {
          std::vector<EvidenceUnits> plane(kBlockVoxels);
          // Up to 75, all evidence for `free` counts.
          const double share = 0.2 + 0.5 * unit(random), long_stay = id == kCar ? 300.0 : 70.0;
          const double most = (id == kCar || id == kFreeClass) && random() % 4 == 0 ? long_stay : 2.0;
          for (EvidenceUnits& units : plane) units = unit(random) < share ? unitsOf(most * unit(random)) : 0;
          block.add(id, plane.data());
        }
      }
    }
  }
  return map;
}

TEST(Neighbours, DecideAsByLookingAtEachOfThem) {
  std::size_t labels[256] = {}, restored = 0, cleared = 0;
  const std::pair<unsigned, int> cases[] = {{1, 2}, {2, 2}, {3, 2}, {4, 2}, {5, 1}, {6, 1}, {7, 3}, {8, 7}};
  for (const auto& [seed, reach] : cases) {
    const SemanticMap map = randomMap(seed);
    const StateRules rules = rulesOfAll(seed % 2 == 0, reach), alone = rules.withNeighbourhood(0.0, {});
    BlockView view;
    for (const auto& [index, block] : map.entries()) {
      readBlock(map, rules, index, *block, BlockFields::kAllButEntropy, view);
      for (int v = 0; v < kBlockVoxels; ++v) {
        const VoxelIndex voxel = GridGeometry::voxelOf(index, v);
        const ClassId expected = slowLabel(map, voxel, rules.neighbourhoodIsBelow(), reach);
        ASSERT_EQ(view.at(v).label, expected) << seed;
        ASSERT_EQ(viewWithoutEntropy(map, rules, voxel).label, expected) << seed;
        ++labels[expected];
        const VoxelView own = viewWithoutEntropy(map, alone, voxel);
        restored += own.label != expected && asks(expected);
        cleared += asks(own.label) && own.label != expected;
        // Nothing else but the state and what follows from it depends on the neighbours.
        ASSERT_EQ(view.at(v).evidence, own.evidence);
        if (own.label == expected) {
          ASSERT_NEAR(view.at(v).occupancy, own.occupancy, 1e-6f);
        }
      }
    }
  }
  for (const ClassId id : {kRoad, kCar, kTruck, kWalker, kFreeClass}) EXPECT_GT(labels[id], 200u) << int{id};
  EXPECT_GT(restored, 500u);
  EXPECT_GT(cleared, 500u);
}

/// A map as randomMap() with looks, most of which end with hits.
SemanticMap lookedAtMap(unsigned seed) {
  std::mt19937 random(seed);
  SemanticMap map = randomMap(seed);
  for (const auto& [index, block] : map.entries()) {
    if (random() % 8 == 0) continue;
    Looks& looks = map.getOrAllocate(index).looks();
    for (std::uint64_t tick = 1000, end = 1001 + random() % 12; tick < end; ++tick) {
      Look::Voxels seen[3];
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        const std::size_t sight = random() % 12;
        if (sight < 4) seen[sight == 3 ? 1 : sight][v] = true;
      }
      looks.add(Look(tick, seen[0], seen[1], seen[2]));
    }
  }
  return map;
}

/// From the definition: here, left, hidden, grazed or unclear.
enum class SlowFate { kHere, kLeft, kHidden, kGrazed, kUnclear };
SlowFate slowFate(const SemanticMap& map, const VoxelIndex& voxel) {
  const Block* const block = map.find(GridGeometry::blockOf(voxel));
  const auto v = static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel));
  const std::vector<Look> looks = block ? block->looks().all() : std::vector<Look>();
  int seen = 0, voids = 0;
  for (auto look = looks.rbegin(); look != looks.rend(); ++look) {
    if (look->at(v) == Sight::kHit) {
      if (seen == 0) return look->length() == 1 ? SlowFate::kHere : SlowFate::kHidden;
      if (voids == 0 && seen <= 2) return SlowFate::kGrazed;
      return voids >= 2 ? SlowFate::kLeft : SlowFate::kUnclear;
    }
    seen += look->at(v) != Sight::kNothing;
    voids += look->at(v) == Sight::kVoid;
  }
  return SlowFate::kUnclear;
}

/// Whether what is around a hidden or grazed voxel is there, from the definition.
bool slowIsStillThere(const SemanticMap& map, const VoxelIndex& voxel, int reach) {
  double here = 0.0, left = 0.0;
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const VoxelIndex at{{voxel.x + x, voxel.y + y, voxel.z + z}};
        const ClassId id = likeliest(map, at);
        const SlowFate fate = slowFate(map, at);
        const bool is_hidden = fate == SlowFate::kHidden;
        if (!asks(id) || (is_hidden && evidenceFor(map, at, id) < 4.0 * kMost - 1e-6)) continue;
        const bool is_here =
            fate == SlowFate::kHere || is_hidden || (fate != SlowFate::kLeft && holds(map, at, id));
        (is_here ? here : left) += std::min(evidenceFor(map, at, id), kMost);
      }
    }
  }
  return here > 0.0 && here >= 2.0 * kRatio * left;
}

TEST(Neighbours, DecideWhetherWhatIsHiddenOrGrazedIsStillThere) {
  std::size_t kept_hidden = 0, kept_grazed = 0, not_kept = 0, elsewhere = 0;
  for (const unsigned seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
    const SemanticMap map = lookedAtMap(seed);
    const int reach = seed == 8 ? 7 : 1 + static_cast<int>(seed % 2);
    const StateRules rules = rulesOfAll(true, reach).withLatest(true);
    const StateRules floors_ask = rulesOfAll(false, reach).withLatest(true);
    EXPECT_FALSE(floors_ask.hiddenAsk());
    BlockView view;
    for (const auto& [index, block] : map.entries()) {
      readBlock(map, rules, index, *block, BlockFields::kStates, view);
      for (int v = 0; v < kBlockVoxels; ++v) {
        const VoxelIndex voxel = GridGeometry::voxelOf(index, v);
        const ClassId id = likeliest(map, voxel);
        const bool is_occupied = view.at(v).state == VoxelState::kOccupied;
        ASSERT_EQ(viewWithoutEntropy(map, rules, voxel).state, view.at(v).state);
        const SlowFate fate = slowFate(map, voxel);
        const bool is_hidden = fate == SlowFate::kHidden;
        if (!asks(id) || evidenceFor(map, voxel, id) == 0.0 || (!is_hidden && fate != SlowFate::kGrazed) ||
            holds(map, voxel, id)) {
          ++elsewhere;
        } else if (slowIsStillThere(map, voxel, reach)) {
          ASSERT_TRUE(is_occupied) << seed << ", block " << index.x << ' ' << index.y << ' ' << index.z
                                   << ", voxel " << v;
          EXPECT_EQ(view.at(v).label, id);
          ++(is_hidden ? kept_hidden : kept_grazed);
        } else {
          // Otherwise it is as without the looks, unless it is hidden and has stayed.
          const ClassId expected = slowLabel(map, voxel, true, reach);
          const bool has_stayed = is_hidden && evidenceFor(map, voxel, id) >= 10.0 * kMost - 1e-6;
          ASSERT_EQ(view.at(v).label, has_stayed ? id : expected);
          ++not_kept;
        }
      }
    }
  }
  EXPECT_GT(kept_hidden, 100u);
  EXPECT_GT(kept_grazed, 100u);
  EXPECT_GT(not_kept, 40u);
  EXPECT_GT(elsewhere, 1000u);
}

/// A row of voxels along x from (0, 0, 0), each with evidence for the car and for `free`.
SemanticMap rowOfCar(const std::vector<std::pair<double, double>>& evidence) {
  SemanticMap map(GridGeometry(0.3), kPrior, 3);
  for (std::size_t n = 0; n < evidence.size(); ++n) {
    const VoxelIndex voxel{{static_cast<int>(n), 0, 0}};
    for (const auto& [id, value] : {std::pair{kCar, evidence[n].first}, {kFreeClass, evidence[n].second}}) {
      std::vector<EvidenceUnits> plane(kBlockVoxels);
      plane[static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel))] = unitsOf(value);
      map.getOrAllocate(GridGeometry::blockOf(voxel)).add(id, plane.data());
    }
  }
  return map;
}

StateRules rulesOfCars() {
  return StateRules()
      .withFreeGain(kCar, 1000.0, 0.3)
      .withHitOfScan(0.025)  // a voxel counts for 0.4 at most
      .withNeighbourhood(2.0, ClassSet().set(kCar));
}

VoxelView viewAt(const SemanticMap& map, int x, const StateRules& rules = rulesOfCars()) {
  return viewWithoutEntropy(map, rules, VoxelIndex{{x, 0, 0}});
}

/// The state of a voxel, by itself and read with its block.
VoxelState stateOf(const SemanticMap& map, const VoxelIndex& voxel) {
  const StateRules rules = rulesOfAll().withLatest(true);
  const BlockIndex index = GridGeometry::blockOf(voxel);
  BlockView view;
  readBlock(map, rules, index, *map.find(index), BlockFields::kStates, view);
  const VoxelState state = viewWithoutEntropy(map, rules, voxel).state;
  EXPECT_EQ(view.at(GridGeometry::offsetInBlock(voxel)).state, state);
  return state;
}

TEST(Neighbours, KeepWhatIsHiddenWhereTheyAreHere) {
  // Both were free for long; only the first is hidden since it was hit.
  SemanticMap map = rowOfCar({{0.3, 10.0}, {0.3, 10.0}});
  Block& block = map.getOrAllocate({{0, 0, 0}});
  Look::Voxels none, first, second, elsewhere;
  first[0] = second[1] = elsewhere[kBlockVoxels - 1] = true;
  const auto state = [&] { return stateOf(map, {{0, 0, 0}}); };
  block.looks().add(Look(1000, none, none, first));
  EXPECT_EQ(state(), VoxelState::kOccupied) << "hit now";
  block.looks().add(Look(1010, elsewhere, none, none));
  EXPECT_EQ(state(), VoxelState::kFree) << "the other was crossed";
  block.looks().add(Look(1011, none, none, second));
  EXPECT_EQ(state(), VoxelState::kOccupied) << "the car is here";
  block.looks().add(Look(1012, none, second, none));
  block.looks().add(Look(1013, none, second, none));
  EXPECT_EQ(state(), VoxelState::kFree) << "it has left";
}

TEST(Neighbours, VoteWhileTheyAreHiddenOnceTheyWereHitForLong) {
  // Both were free for long, and have been hidden since they were hit, the second one in 63 or 64 scans.
  for (const double of_second : {63.0 / 16.0 * kMost, 4.0 * kMost}) {
    SemanticMap map = rowOfCar({{0.3, 10.0}, {of_second, 1000.0}});
    Block& block = map.getOrAllocate({{0, 0, 0}});
    Look::Voxels none, both, elsewhere;
    both[0] = both[1] = elsewhere[kBlockVoxels - 1] = true;
    block.looks().add(Look(1000, none, none, both));
    block.looks().add(Look(1010, elsewhere, none, none));
    EXPECT_EQ(stateOf(map, {{0, 0, 0}}), of_second < 4.0 * kMost ? VoxelState::kFree : VoxelState::kOccupied);
  }
}

TEST(Neighbours, KeepWhatTwoIntervalsGrazeWhereTheyAreHere) {
  SemanticMap map = rowOfCar({{0.3, 10.0}, {4.0, 100.0}});
  Block& block = map.getOrAllocate({{0, 0, 0}});
  Look::Voxels none, first, second;
  first[0] = second[1] = true;
  const auto state = [&] { return stateOf(map, {{0, 0, 0}}); };
  block.looks().add(Look(1000, none, none, first));
  block.looks().add(Look(1010, first, none, second));
  EXPECT_EQ(state(), VoxelState::kOccupied);
  block.looks().add(Look(1020, first, none, second));
  EXPECT_EQ(state(), VoxelState::kOccupied);
  const Looks grazed_twice = block.looks();
  block.looks().add(Look(1030, first, none, second));
  EXPECT_EQ(state(), VoxelState::kFree) << "crossed in three intervals";
  block.looks() = grazed_twice;
  block.looks().add(Look(1020, none, first, second));
  EXPECT_EQ(state(), VoxelState::kFree) << "void in one";
}

TEST(Neighbours, DoNotKeepWhatBeamsCrossTwiceInALaterVisit) {
  SemanticMap map = rowOfCar({{0.3, 10.0}, {4.0, 100.0}});
  Block& block = map.getOrAllocate({{0, 0, 0}});
  Look::Voxels none, first, second;
  first[0] = second[1] = true;
  block.looks().add(Look(1000, none, none, first));
  block.looks().add(Look(10000, first, none, second));  // 40 minutes later
  EXPECT_EQ(stateOf(map, {{0, 0, 0}}), VoxelState::kOccupied);
  block.looks().add(Look(10001, first, none, second));
  EXPECT_EQ(stateOf(map, {{0, 0, 0}}), VoxelState::kFree);
}

TEST(Neighbours, AreNeededToKeepWhatIsHidden) {
  SemanticMap map = rowOfCar({{0.3, 10.0}});
  Look::Voxels none, first, elsewhere;
  first[0] = elsewhere[kBlockVoxels - 1] = true;
  Block& block = map.getOrAllocate({{0, 0, 0}});
  block.looks().add(Look(1000, none, none, first));
  block.looks().add(Look(1010, elsewhere, none, none));
  EXPECT_EQ(stateOf(map, {{0, 0, 0}}), VoxelState::kFree);
}

TEST(Neighbours, ClearWhatIsLeftOfACar) {
  // Beams have crossed all of these voxels but one.
  const SemanticMap map = rowOfCar({{0.1, 0.1}, {0.1, 0.1}, {0.08, 0.0}, {0.1, 0.1}, {0.1, 0.1}});
  EXPECT_EQ(viewAt(map, 2).state, VoxelState::kFree);
  EXPECT_LT(viewAt(map, 2).occupancy, 0.05f);
  EXPECT_FLOAT_EQ(viewAt(map, 2).evidence, evidenceOf(unitsOf(0.08)));
}

TEST(Neighbours, KeepARoofThatBeamsGraze) {
  const SemanticMap map = rowOfCar({{0.2, 0.0}, {0.2, 0.0}, {0.06, 0.1}, {0.2, 0.0}, {0.2, 0.0}});
  EXPECT_EQ(viewAt(map, 2).state, VoxelState::kOccupied);
  EXPECT_EQ(viewAt(map, 2).label, kCar);
  EXPECT_GT(viewAt(map, 2).occupancy, 0.8f);
  EXPECT_FLOAT_EQ(viewAt(map, 2).evidence, evidenceOf(unitsOf(0.06)) + evidenceOf(unitsOf(0.1)));
}

TEST(Neighbours, DoNotKeepTheHaloOfASurface) {
  // Less than a quarter of the mean of the voxels that are kept: only the fringe of kernels reached it.
  const SemanticMap map = rowOfCar({{0.2, 0.0}, {0.2, 0.0}, {0.04, 0.1}, {0.2, 0.0}, {0.2, 0.0}});
  EXPECT_EQ(viewAt(map, 2).state, VoxelState::kFree);
  EXPECT_EQ(viewAt(map, 1).state, VoxelState::kOccupied);
}

TEST(Neighbours, DoNotKeepWhatBeamsCrossedAgainAndAgain) {
  // 1 / 20 of the evidence for free, as in the occupancy.
  for (const double free : {1.19, 1.21}) {
    const SemanticMap map = rowOfCar({{0.2, 0.0}, {0.2, 0.0}, {0.06, free}, {0.2, 0.0}, {0.2, 0.0}});
    EXPECT_EQ(viewAt(map, 2).state, free < 1.2 ? VoxelState::kOccupied : VoxelState::kFree);
  }
}

TEST(Neighbours, CountForAtMostSixteenScans) {
  // 0.05 is a quarter of the mean of 0.1 and 0.4, not of that of 0.1 and more.
  const auto kept = [](double evidence) {
    return viewAt(rowOfCar({{0.1, 0.0}, {evidence, 0.0}, {0.0625, 0.1}}), 2).state == VoxelState::kOccupied;
  };
  EXPECT_TRUE(kept(0.4));
  EXPECT_TRUE(kept(40.0));
  const SemanticMap map = rowOfCar({{0.1, 0.0}, {40.0, 0.0}, {0.0625, 0.1}});
  EXPECT_EQ(viewAt(map, 2, rulesOfCars().withHitOfScan(2.5)).state, VoxelState::kFree);
}

TEST(Neighbours, BelowAreNotAskedWhereFloorsVote) {
  // A row of cars that have left, above a floor of the same class.
  for (const bool asks_below : {true, false}) {
    SemanticMap map = rowOfCar({});
    const StateRules rules = rulesOfCars().withNeighbourhood(0.5, ClassSet().set(kCar), asks_below);
    std::vector<EvidenceUnits> hits(kBlockVoxels), misses(kBlockVoxels);
    for (int x = 0; x < kBlockEdge; ++x) {
      const auto at = [x](int z) {
        return static_cast<std::size_t>(GridGeometry::offsetInBlock(VoxelIndex{{x, 0, z}}));
      };
      hits[at(0)] = unitsOf(0.3);
      hits[at(1)] = unitsOf(0.1);
      misses[at(1)] = unitsOf(0.3);
    }
    Block& block = map.getOrAllocate({{0, 0, 0}});
    block.add(kCar, hits.data());
    block.add(kFreeClass, misses.data());
    const auto state = [&](int z) { return viewWithoutEntropy(map, rules, VoxelIndex{{4, 0, z}}).state; };
    EXPECT_EQ(state(0), VoxelState::kOccupied);
    EXPECT_EQ(state(1), asks_below ? VoxelState::kOccupied : VoxelState::kFree);
  }
}

TEST(Neighbours, AreAskedAcrossBlocksUpToTwoVoxelsAway) {
  // In the second block, voxel 8 has crossed ones at distance 2, voxel 9 only at distance 3.
  const SemanticMap map =
      rowOfCar({{0, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 0}, {9, 90}, {9, 90}, {0, 0}, {0.1, 0}, {0.1, 0}});
  EXPECT_EQ(viewAt(map, 8).state, VoxelState::kFree);
  EXPECT_EQ(viewAt(map, 9).state, VoxelState::kOccupied);
}

TEST(Neighbours, OfOtherClassesAreNotAsked) {
  const SemanticMap map = rowOfCar({{0.1, 0.1}, {0.08, 0.0}, {0.1, 0.1}});
  EXPECT_EQ(viewAt(map, 1).state, VoxelState::kFree);
  const StateRules rules = rulesOfCars().withNeighbourhood(2.0, ClassSet().set(kTruck));
  EXPECT_EQ(viewAt(map, 1, rules).state, VoxelState::kOccupied);
}

TEST(Neighbours, DependentsAreAllWhoseStatesChange) {
  std::mt19937 random(3);
  SemanticMap map = lookedAtMap(9);
  const StateRules rules = rulesOfAll().withLatest(true);
  std::size_t elsewhere = 0;
  for (int round = 0; round < 20; ++round) {
    const SemanticMap before = map.snapshot();
    const BlockIndex changed{{static_cast<int>(random() % 3) - 1, static_cast<int>(random() % 3) - 1, 0}};
    if (round % 4 == 3) {
      map.erase(changed);
    } else {
      std::vector<EvidenceUnits> plane(kBlockVoxels, unitsOf(0.3));
      Block& block = map.getOrAllocate(changed);
      if (round % 4 != 2) block.add(random() % 2 == 0 ? kCar : kFreeClass, plane.data());
      Look::Voxels seen;
      for (std::size_t v = 0; v < kBlockVoxels; ++v) seen[v] = random() % 3 == 0;
      const Look::Voxels none;
      const bool is_hit = random() % 2 == 0;
      block.looks().add(
          Look(1020 + static_cast<std::uint64_t>(round), none, is_hit ? none : seen, is_hit ? seen : none));
    }
    const std::vector<GridIndex> touched = {changed},
                                 all = withDependents(map, rules, {touched.data(), touched.size()});
    for (const auto& [index, block] : map.entries()) {
      if (!before.find(index)) continue;
      BlockView now, then;
      readBlock(map, rules, index, *block, BlockFields::kStates, now);
      readBlock(before, rules, index, *before.find(index), BlockFields::kStates, then);
      const bool same = now.state == then.state && now.label == then.label;
      elsewhere += !same && index != changed;
      EXPECT_TRUE(same || std::find(all.begin(), all.end(), index) != all.end());
    }
  }
  EXPECT_GT(elsewhere, 10u);
}

}  // namespace
}  // namespace bki_mapping
