// Snapshots stay as they are, whatever happens to the map, and in whichever thread they are read.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "reference/content.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

using Content = std::map<GridIndex, std::string>;
using reference::contentOf;

SemanticMap emptyMap() {
  return {GridGeometry(0.3), 0.001, 3};
}

void addTo(SemanticMap& map, const BlockIndex& index, EvidenceUnits units) {
  EvidenceUnits plane[kBlockVoxels] = {};
  plane[7] = units;
  map.getOrAllocate(index).add(1, plane);
}

TEST(Snapshot, StaysAsItIsWhateverComesAndGoes) {
  std::mt19937 random(5);
  SemanticMap map = emptyMap();
  Content truth;  // of the map, kept by a map without snapshots
  SemanticMap plain = emptyMap();
  std::vector<std::pair<SemanticMap, Content>> snapshots;
  for (int step = 0; step < 6000; ++step) {
    const auto coordinate = [&] { return static_cast<int>(random() % 24) - 12; };
    const BlockIndex index = {{coordinate(), coordinate(), coordinate() / 6}};
    if (random() % 3 == 0) {
      map.erase(index);
      plain.erase(index);
    } else {
      addTo(map, index, step + 1);
      addTo(plain, index, step + 1);
    }
    if (step % 400 == 100) snapshots.emplace_back(map.snapshot(), contentOf(plain));
    if (step % 900 == 800) snapshots.erase(snapshots.begin());
    if (step == 4000) {
      map.clear();
      plain.clear();
    }
    ASSERT_EQ(map.size(), plain.size());
  }
  EXPECT_EQ(contentOf(map), contentOf(plain));
  ASSERT_GT(snapshots.size(), 5u);
  map.clear();
  for (const auto& [snapshot, content] : snapshots) {
    EXPECT_EQ(contentOf(snapshot), content);
    EXPECT_EQ(snapshot.size(), content.size());
  }
}

TEST(Snapshot, IsAMapOfItsOwn) {
  SemanticMap map = emptyMap();
  for (int x = 0; x < 20; ++x) addTo(map, {{x, 0, 0}}, 1);
  SemanticMap one = map.snapshot();
  const Content before = contentOf(map);
  addTo(one, {{3, 0, 0}}, 5);
  one.erase({{4, 0, 0}});
  addTo(one, {{40, 0, 0}}, 5);
  const SemanticMap two = one.snapshot();
  const Content of_one = contentOf(one);
  addTo(one, {{3, 0, 0}}, 5);
  EXPECT_EQ(contentOf(map), before);
  EXPECT_EQ(contentOf(two), of_one);
  EXPECT_EQ(one.find({{3, 0, 0}})->evidence(1)[7], 11);
}

TEST(Snapshot, KeepsTheGeometry) {
  SemanticMap map(GridGeometry(0.25), 0.002, 3);
  const SemanticMap snapshot = map.snapshot();
  EXPECT_EQ(snapshot.geometry().resolution(), 0.25);
  EXPECT_EQ(snapshot.prior(), 0.002);
  EXPECT_EQ(snapshot.classCount(), 3u);
}

TEST(Snapshot, KeepsTheRulesOfItsTime) {
  MapperConfig config;
  config.rules.enabled = true;
  SemanticMapper mapper(config, reference::smallTable());
  const MapSnapshot snapshot = mapper.snapshot();
  EXPECT_TRUE(snapshot.rules.decidesAs(mapper.rules()));
  config.rules.together = 0.0;
  mapper.reconfigure(config);
  EXPECT_GT(snapshot.rules.neighbourhoodRatio(), 0.0f);
  EXPECT_EQ(mapper.rules().neighbourhoodRatio(), 0.0f);
  EXPECT_TRUE(snapshot.rules.isFixed(1) && !snapshot.rules.isFixed(0)) << "what is unlabelled may move";
  EXPECT_FALSE(snapshot.rules.decidesAs(mapper.rules()));
}

std::vector<Scan> someScans() {
  std::vector<Scan> scans;
  for (const reference::Scene& scene : reference::nastyScenes(400)) scans.push_back(scene.scan);
  return scans;
}

TEST(Snapshot, OfAMapperIsTheMapOfTheScansUntilThen) {
  for (const int threads : {1, 2}) {
    MapperConfig config;
    config.threads = threads;
    SemanticMapper mapper(config, reference::smallTable()), plain(config, reference::smallTable());
    std::vector<std::pair<SemanticMap, Content>> snapshots;
    for (const Scan& scan : someScans()) {
      mapper.integrate(scan);
      plain.integrate(scan);
      snapshots.emplace_back(mapper.snapshot().map, contentOf(plain.map()));
      ASSERT_EQ(mapper.mapBytes(), mapper.map().bytes());
    }
    mapper.withdraw(someScans()[0]);
    plain.withdraw(someScans()[0]);
    mapper.eraseBlocks([](const BlockIndex& block) { return block.x > 0; });
    plain.eraseBlocks([](const BlockIndex& block) { return block.x > 0; });
    EXPECT_EQ(contentOf(mapper.map()), contentOf(plain.map()));
    EXPECT_EQ(mapper.mapBytes(), mapper.map().bytes());
    for (const auto& [snapshot, content] : snapshots) EXPECT_EQ(contentOf(snapshot), content);
  }
}

/// Sums all evidence of a map.
std::int64_t sumOf(const SemanticMap& map) {
  std::int64_t sum = 0;
  for (const auto& [index, block] : map.entries()) {
    for (std::size_t c = 0; c < block->classes().size(); ++c) {
      for (int v = 0; v < kBlockVoxels; ++v) sum += block->plane(c)[v];
    }
  }
  return sum;
}

TEST(Snapshot, IsReadInOtherThreadsWhileTheMapperWrites) {
  const std::vector<Scan> scans = someScans();
  MapperConfig config;
  config.threads = 2;
  SemanticMapper mapper(config, reference::smallTable());
  mapper.integrate(scans[0]);
  std::mutex mutex;
  auto latest = std::make_shared<const SemanticMap>(mapper.snapshot().map);
  std::atomic<bool> done{false};
  std::atomic<int> read{0};
  const auto reader = [&] {
    while (!done) {
      std::shared_ptr<const SemanticMap> snapshot;
      {
        const std::lock_guard<std::mutex> lock(mutex);
        snapshot = latest;
      }
      const std::int64_t sum = sumOf(*snapshot);
      EXPECT_EQ(sumOf(*snapshot), sum);
      ++read;
    }
  };
  std::thread one(reader), two(reader);
  for (std::size_t n = 0; n < 150 || read < 20; ++n) {
    mapper.integrate(scans[n % scans.size()]);
    if (n % 5 == 4) mapper.eraseBlocks([&](const BlockIndex& block) { return block.x % 3 == 0; });
    auto snapshot = std::make_shared<const SemanticMap>(mapper.snapshot().map);
    const std::lock_guard<std::mutex> lock(mutex);
    latest = std::move(snapshot);
  }
  done = true;
  one.join();
  two.join();
}

}  // namespace
}  // namespace bki_mapping
