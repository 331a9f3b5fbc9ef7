// What a StateMap takes over from that of an earlier snapshot equals what it would find out itself, whatever
// has happened to the map between the two, and whoever asks them meanwhile.
#include "bki_mapping/query/state_map.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "query/slow_frontiers.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

/// A snapshot with its states.
struct Snapshot {
  explicit Snapshot(MapSnapshot taken) : map(std::move(taken.map)), states(map, taken.rules, 1) {}
  Snapshot(MapSnapshot taken, const Snapshot& earlier)
      : map(std::move(taken.map)), states(map, taken.rules, earlier.states, 1) {}

  SemanticMap map;
  StateMap states;
};

void expectSameStates(const StateMap& states) {
  for (const auto& [index, block] : states.map().entries()) {
    const BlockStates& found = *states.find(index);
    ASSERT_EQ(found.block, block);
    bool any_occupied = false, any_free = false, all_free = true;
    for (int offset = 0; offset < kBlockVoxels; ++offset) {
      const VoxelView view = viewWithoutEntropy(states.map(), states.rules(), index, *block, offset);
      ASSERT_EQ(found.state(offset), view.state);
      ASSERT_EQ(found.labels[static_cast<std::size_t>(offset)], view.label);
      any_occupied |= view.state == VoxelState::kOccupied;
      any_free |= view.state == VoxelState::kFree;
      all_free &= view.state == VoxelState::kFree;
    }
    ASSERT_EQ(found.any_occupied, any_occupied);
    ASSERT_EQ(found.any_free, any_free);
    ASSERT_EQ(found.all_free, all_free);
    const auto glance = states.region(SemanticMap::regionOf(index))->glance(states, index);
    ASSERT_EQ(glance.any_occupied, any_occupied);
    ASSERT_EQ(glance.all_free, all_free);
  }
}

void expectSameFrontiers(const StateMap& states) {
  const StateMap fresh(states.map(), states.rules(), 1);
  const std::vector<Frontier> found = frontiers(states), expected = frontiers(fresh);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t f = 0; f < found.size(); ++f) {
    ASSERT_EQ(found[f].size, expected[f].size);
    ASSERT_EQ(found[f].centre, expected[f].centre);
    ASSERT_EQ(found[f].voxels, expected[f].voxels);
  }
}

/// Changes a map at random in a road of 24 x 6 x 2 blocks, which crosses regions.
class RandomChanges {
 public:
  explicit RandomChanges(unsigned seed) : random_(seed) {}

  SemanticMap emptyMap() const { return {GridGeometry(0.25), 0.001, 8}; }
  std::size_t draw(std::size_t below) { return random_() % below; }
  /// The present rules, which changes may replace.
  const StateRules& rules() const { return rules_; }
  MapSnapshot snapshotOf(SemanticMap& map) const { return {map.snapshot(), rules_}; }

  void change(SemanticMap& map) {
    switch (draw(12)) {
      case 0:  // forget
        for (int n = 0; n < 5; ++n) map.erase(anyBlock());
        break;
      case 1: {
        const Eigen::Vector3d low = map.geometry().voxelCentre(GridGeometry::voxelOf(anyBlock(), 77));
        clearBox(map, {low, low + Eigen::Vector3d(4.0, 3.0, 2.1)});
        break;
      }
      case 2: {  // load
        SemanticMap other = emptyMap();
        for (int n = 0; n < 4; ++n) add(other, anyBlock());
        if (draw(2) == 0) {
          map.add(other);
        } else {
          map.add(std::move(other));
        }
        break;
      }
      case 3:
        rules_ = rules_.withFreeGain(static_cast<ClassId>(3 * draw(2)), 0.2 + 3.0 * unit());
        break;
      case 4:
        rules_ = rules_.withHitOfScan(draw(2) == 0 ? 0.0 : 3.0 * unit());
        rules_ = rules_.withLatest(draw(2) == 0);
        rules_ = rules_.withRemaining(draw(2) == 0 ? 0.0 : unit(), draw(2) == 0 ? 0b1001 : 0b11001000);
        rules_ = rules_.withNeighbourhood(draw(3) == 0 ? 0.0 : 3.0 * unit(), draw(3) == 0 ? 0b1000 : 0b1001);
        break;
      case 5:
        if (draw(15) == 0) map.clear();
        break;
      case 6: {  // leave a region, and come back
        SemanticMap taken = map.takeRegion(SemanticMap::regionOf(anyBlock()));
        if (draw(4) != 0) map.add(std::move(taken));
        break;
      }
      case 7:
        for (int n = 0; n < 3; ++n) occlude(map, anyBlock());
        break;
      default:
        scan(map);
    }
  }
  void scan(SemanticMap& map) {
    for (int n = 0; n < 25; ++n) add(map, anyBlock());
  }

 private:
  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  BlockIndex anyBlock() {
    return {{static_cast<int>(draw(24)) - 12, static_cast<int>(draw(6)) - 3, static_cast<int>(draw(2)) - 1}};
  }
  /// Adds evidence, or withdraws some, in a part of a block.
  void add(SemanticMap& map, const BlockIndex& index) {
    std::vector<EvidenceUnits> plane(kBlockVoxels);
    for (const ClassId id : {ClassId{0}, ClassId{3}, kFreeClass}) {
      const double share = id == kFreeClass ? 0.9 : 0.1 * unit();
      const std::size_t first = draw(kBlockVoxels);
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        const bool in = v >= first && unit() < share;
        plane[v] = in ? unitsOf((draw(4) == 0 ? -1.0 : 1.0) * unit()) : 0;
      }
      map.getOrAllocate(index).add(id, plane.data());
    }
    Look::Voxels seen[3];
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      const std::size_t sight = draw(8);
      if (sight < 3) seen[sight][v] = true;
    }
    map.getOrAllocate(index).looks().add(Look(1000 + draw(20), seen[0], seen[1], seen[2]));
  }
  void occlude(SemanticMap& map, const BlockIndex& index) {
    if (!map.find(index)) return;
    Block::Occlusion marks = map.find(index)->occlusion();
    for (int n = 0; n < 20; ++n) marks.flip(draw(kBlockVoxels));
    map.getOrAllocate(index).setOcclusion(marks);
  }

  std::mt19937 random_;
  StateRules rules_;
};

TEST(StateMap, TakesOverWhatItWouldDecideItself) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    RandomChanges changes(seed);
    SemanticMap map = changes.emptyMap();
    for (int n = 0; n < 20; ++n) changes.change(map);
    auto last = std::make_unique<Snapshot>(changes.snapshotOf(map));
    std::unique_ptr<Snapshot> before_last;
    for (int step = 0; step < 60; ++step) {
      // Some snapshots are asked for everything, some for a part, some for nothing.
      const std::size_t asked = changes.draw(4);
      if (asked == 0) frontiers(last->states);
      if (asked == 1) {
        for (const auto& entry : last->map.entries()) {
          if (changes.draw(3) == 0) last->states.find(entry.index);
        }
      }
      for (std::size_t n = changes.draw(3); n-- > 0;) changes.change(map);
      if (step == 59) changes.scan(map);
      auto next = std::make_unique<Snapshot>(changes.snapshotOf(map), *last);
      if (changes.draw(2) == 0) before_last = std::move(last);  // else it is freed, before or after the next
      last = std::move(next);
      if (changes.draw(2) == 0) before_last = nullptr;
      if (step % 3 != 2) continue;
      SCOPED_TRACE("seed " + std::to_string(seed) + ", step " + std::to_string(step));
      ASSERT_NO_FATAL_FAILURE(expectSameStates(last->states));
      ASSERT_NO_FATAL_FAILURE(expectSameFrontiers(last->states));
      if (!before_last) continue;
      ASSERT_NO_FATAL_FAILURE(expectSameStates(before_last->states));
      ASSERT_NO_FATAL_FAILURE(expectSameFrontiers(before_last->states));
    }
    ASSERT_GT(map.size(), 20u);
    EXPECT_EQ(clustersOf(frontiers(last->states)), slowFrontiers(map, changes.rules()));
  }
}

TEST(StateMap, TakesOverWhatItWouldDecideItselfWhileAMapperMaps) {
  MapperConfig config;
  config.resolution = 0.2;
  config.threads = 2;
  for (const auto occlusion : {OcclusionExtent::kNone, OcclusionExtent::kAll}) {
    config.occlusion = occlusion;
    SemanticMapper mapper(config, reference::smallTable());
    const std::vector<reference::Scene> scenes = reference::nastyScenes();
    std::unique_ptr<Snapshot> last = std::make_unique<Snapshot>(mapper.snapshot());
    const auto changed = [&](const std::string& by) {
      auto next = std::make_unique<Snapshot>(mapper.snapshot(), *last);
      last = std::move(next);
      SCOPED_TRACE(by);
      ASSERT_NO_FATAL_FAILURE(expectSameStates(last->states));
      ASSERT_NO_FATAL_FAILURE(expectSameFrontiers(last->states));
    };
    for (int round = 0; round < 2; ++round) {
      for (const reference::Scene& scene : scenes) {
        mapper.integrate(scene.scan);
        changed(scene.name);
      }
      for (std::size_t n = 0; occlusion == OcclusionExtent::kNone && n < scenes.size(); n += 2) {
        mapper.withdraw(scenes[n].scan);
        changed("without " + scenes[n].name);
      }
      MapperConfig other = mapper.config();
      other.rules.stands_after = round == 0 ? 1.0 : 20.0;
      mapper.reconfigure(other);
      changed("other gains");
      mapper.clearBox({Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 0, 2)});
      changed("a cleared box");
      mapper.eraseBlocks([](const GridIndex& index) { return index.x > 1; });
      changed("forgotten blocks");
      if (round == 0) mapper.reset();
      changed("a reset");
    }
  }
}

/// A map of three regions in a row, each with a block of free voxels at either end.
SemanticMap rowOfRegions() {
  SemanticMap map(GridGeometry(0.25), 0.001, 8);
  const std::vector<EvidenceUnits> plane(kBlockVoxels, unitsOf(1.0));
  for (int region = 0; region < 3; ++region) {
    for (int n = 0; n < 2; ++n) {
      map.getOrAllocate({{Region::kEdge * region + (Region::kEdge - 1) * n, 0, 0}})
          .add(kFreeClass, plane.data());
    }
  }
  return map;
}

TEST(StateMap, DecidesUnchangedBlocksOnce) {
  SemanticMap map = rowOfRegions();
  StateRules rules;
  Snapshot first({map.snapshot(), rules});
  frontiers(first.states);
  const std::vector<EvidenceUnits> plane(kBlockVoxels, unitsOf(1.0));
  map.getOrAllocate({{0, 0, 0}}).add(3, plane.data());
  const Snapshot second({map.snapshot(), rules}, first);
  EXPECT_NE(second.states.find({{0, 0, 0}}), first.states.find({{0, 0, 0}}));
  EXPECT_EQ(second.states.find({{Region::kEdge - 1, 0, 0}}), first.states.find({{Region::kEdge - 1, 0, 0}}));
  const auto kept = [](const Snapshot& snapshot, int region) {
    return snapshot.states.keptFrontiers(snapshot.map.positionOf({region, 0, 0}));
  };
  EXPECT_NE(kept(first, 0), nullptr);
  EXPECT_EQ(kept(second, 0), nullptr);
  EXPECT_EQ(kept(second, 1), nullptr) << "its neighbour has changed";
  EXPECT_NE(kept(second, 2), nullptr);
  EXPECT_EQ(kept(second, 2), kept(first, 2));
  rules = rules.withFreeGain(7, 2.0);
  const Snapshot third({map.snapshot(), rules}, second);
  EXPECT_EQ(kept(third, 2), nullptr) << "the rules have changed";
  EXPECT_NE(third.states.find({{16, 0, 0}}), second.states.find({{16, 0, 0}}));
}

TEST(StateMap, KeepsNoEarlierOne) {
  SemanticMap map = rowOfRegions();
  auto last = std::make_unique<Snapshot>(MapSnapshot{map.snapshot(), {}});
  frontiers(last->states);
  const std::weak_ptr<const RegionFrontiers> of_first = last->states.keptFrontiers(map.positionOf({0, 0, 0}));
  const std::vector<EvidenceUnits> plane(kBlockVoxels, unitsOf(1.0));
  map.getOrAllocate({{0, 0, 0}}).add(3, plane.data());
  auto next = std::make_unique<Snapshot>(MapSnapshot{map.snapshot(), {}}, *last);
  last = std::move(next);
  EXPECT_TRUE(of_first.expired());
}

TEST(StateMap, IsAskedAndTakenOverAtOnce) {
  RandomChanges changes(9);
  SemanticMap map = changes.emptyMap();
  for (int n = 0; n < 20; ++n) changes.change(map);
  using Shared = std::shared_ptr<const Snapshot>;
  Shared last = std::make_shared<const Snapshot>(changes.snapshotOf(map));
  std::atomic<bool> done{false};
  const auto ask = [&](bool whole) {
    while (!done) {
      const Shared asked = std::atomic_load(&last);
      if (whole) {
        frontiers(asked->states);
      } else {
        for (const auto& entry : asked->map.entries()) asked->states.find(entry.index);
      }
    }
  };
  std::thread searching([&] { ask(true); }), reading([&] { ask(false); });
  for (int step = 0; step < 300; ++step) {
    changes.change(map);
    std::atomic_store(&last, std::make_shared<const Snapshot>(changes.snapshotOf(map), *last));
  }
  done = true;
  searching.join();
  reading.join();
  expectSameStates(last->states);
  expectSameFrontiers(last->states);
}

TEST(Frontiers, PreparedInWholeOrInPartEqualLookingAtEveryVoxel) {
  RandomChanges changes(4);
  SemanticMap map = changes.emptyMap();
  for (int n = 0; n < 80; ++n) changes.change(map);
  const auto all = slowFrontiers(map, changes.rules());
  const std::size_t regions = map.regionCount();
  ASSERT_GT(regions, 3u);
  for (const std::size_t most : {std::size_t{0}, regions / 2, regions}) {
    const StateMap states(map, changes.rules(), 1);
    std::size_t prepared = 0;
    prepareFrontiers(states, [&] { return prepared++ < most; });
    std::size_t kept = 0;
    for (std::uint32_t r = 0; r < regions; ++r) kept += states.keptFrontiers(r) != nullptr;
    EXPECT_EQ(kept, most);
    EXPECT_EQ(clustersOf(frontiers(states)), all);
  }
  for (int n = 0; n < 20; ++n) {
    const StateMap states(map, changes.rules(), 1);
    std::thread ahead([&] { prepareFrontiers(states, [] { return true; }); });
    const auto found = clustersOf(frontiers(states));
    ahead.join();
    ASSERT_EQ(found, all);
  }
}

TEST(Frontiers, OfManyRegionsEqualLookingAtEveryVoxel) {
  RandomChanges changes(3);
  SemanticMap map = changes.emptyMap();
  for (int n = 0; n < 80; ++n) changes.change(map);
  const auto all = slowFrontiers(map, changes.rules());
  // Boxes that contain some regions, and cut others: a region has an edge of 16 m.
  for (const double low : {-17.0, -16.0, -0.25, 3.1}) {
    FrontierRules rules;
    rules.box.emplace(Eigen::Vector3d(low, -16.0, -16.0), Eigen::Vector3d(24.0, 16.0, 16.0));
    const StateMap states(map, changes.rules(), 2);
    const auto in_box =
        slowFrontiers(map, changes.rules(), [&](const VoxelIndex& v) { return 0.25 * (v.x + 1) > low; });
    EXPECT_EQ(clustersOf(frontiers(states, rules)), in_box);
    EXPECT_EQ(clustersOf(frontiers(states)), all);
    EXPECT_EQ(clustersOf(frontiers(states, rules)), in_box) << "although all are kept";
  }
}

}  // namespace
}  // namespace bki_mapping
