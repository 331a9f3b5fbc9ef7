// Laws of the map that need no reference: of threads, order, sums, shifts, and of what a mode may change.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <set>
#include <tuple>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "free_space/free_space_model.h"
#include "reference/content.h"
#include "reference/scenes.h"
#include "refusal_of.h"

namespace bki_mapping {
namespace {

const std::vector<std::string> kModes = freeSpaceModes();

std::vector<Scan> someScans() {
  std::vector<Scan> scans;
  for (const reference::Scene& scene : reference::nastyScenes(200)) {
    if (scene.name != "far from zero") scans.push_back(scene.scan);
  }
  for (std::size_t n = 0; n < scans.size(); ++n) scans[n].stamp = 1000000000 + 400000000 * n;
  return scans;
}

SemanticMap mapOf(const std::vector<Scan>& scans, MapperConfig config) {
  SemanticMapper mapper(config, reference::smallTable());
  SemanticMap map = SemanticMap(mapper.map().geometry(), applied(config).prior, mapper.classes().size());
  for (const Scan& scan : scans) mapper.integrate(scan);
  map.add(mapper.map());
  return map;
}

MapperConfig configOf(const std::string& mode, int threads = 2) {
  MapperConfig config;
  config.free_space.mode = mode;
  config.free_space.gap = 0.5;
  config.free_space.samples_per_beam = 2;
  config.occlusion = OcclusionExtent::kMapped;
  config.threads = threads;
  return config;
}

/// Calls check(label, evidence in a, evidence in b, index, offset) for all evidence in a; no plane means 0.
template <typename Check>
void compare(const SemanticMap& a, const SemanticMap& b, const BlockIndex& shift, Check&& check) {
  static const std::vector<EvidenceUnits> kNothing(kBlockVoxels, 0);
  for (const auto& entry : a.entries()) {
    const Block* other =
        b.find({{entry.index.x + shift.x, entry.index.y + shift.y, entry.index.z + shift.z}});
    for (const ClassId label : entry.block->classes()) {
      const EvidenceUnits* theirs = other ? other->evidence(label) : nullptr;
      if (!theirs) theirs = kNothing.data();
      for (int v = 0; v < kBlockVoxels; ++v) check(label, entry.block->evidence(label)[v], theirs[v]);
    }
  }
}

void expectNear(const SemanticMap& a, const SemanticMap& b, const BlockIndex& shift,
                const std::string& what) {
  std::size_t faults = 0;
  const auto check = [&](ClassId, EvidenceUnits x, EvidenceUnits y) {
    faults += std::abs(x - y) > 1 + std::abs(x) / 10000;
  };
  compare(a, b, shift, check);
  compare(b, a, {{-shift.x, -shift.y, -shift.z}}, check);
  EXPECT_EQ(faults, 0u) << what;
  EXPECT_GT(a.size(), 0u) << what;
}

TEST(Laws, ThreadCountChangesNoBit) {
  for (const std::string& mode : kModes) {
    const SemanticMap one = mapOf(someScans(), configOf(mode, 1));
    for (const int threads : {2, 7}) {
      const SemanticMap many = mapOf(someScans(), configOf(mode, threads));
      ASSERT_EQ(one.size(), many.size()) << mode;
      for (const auto& entry : one.entries()) {
        const Block* other = many.find(entry.index);
        ASSERT_NE(other, nullptr) << mode;
        ASSERT_EQ(entry.block->classes(), other->classes()) << mode;
        EXPECT_EQ(entry.block->occlusion(), other->occlusion()) << mode;
        for (std::size_t p = 0; p < other->classes().size(); ++p) {
          EXPECT_EQ(std::memcmp(entry.block->plane(p), other->plane(p), kBlockVoxels * sizeof(EvidenceUnits)),
                    0)
              << mode << " with " << threads << " threads";
        }
      }
    }
  }
}

/// Settings under which the map is a sum: it depends on no order.
std::vector<std::pair<std::string, MapperConfig>> additiveConfigs() {
  std::vector<std::pair<std::string, MapperConfig>> configs;
  for (const std::string& mode : kModes) {
    MapperConfig config = configOf(mode);
    config.occlusion = OcclusionExtent::kNone;
    configs.emplace_back(mode, config);
    config.kernel.type = KernelType::kCounting;
    configs.emplace_back(mode + ", counting", config);
    config.kernel.type = KernelType::kSparse;
    config.scan_rules.hits_before_misses = true;
    config.scan_rules.most_hits = 0.05f;
    config.scan_rules.most_free = 0.03f;
    config.scan_rules.free_threshold = 0.002f;
    config.scan_rules.void_evidence = 0.2f;
    configs.emplace_back(mode + ", with rules and limits", config);
    config.scan_rules.static_spread = false;
    configs.emplace_back(mode + ", with rules and hits that stay in their voxels", config);
    config.rules.enabled = true;
    configs.emplace_back(mode + ", with looks", config);
  }
  return configs;
}

TEST(Laws, ThreadCountChangesNoBitWithRules) {
  for (const auto& [name, config] : additiveConfigs()) {
    MapperConfig one = config, many = config;
    one.threads = 1;
    many.threads = 7;
    EXPECT_EQ(reference::contentOf(mapOf(someScans(), one)), reference::contentOf(mapOf(someScans(), many)))
        << name;
  }
}

/// The same scans, each point with two classes.
std::vector<Scan> withSoftLabels(std::vector<Scan> scans) {
  for (Scan& scan : scans) {
    scan.labels_are_ids = true;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const float share = static_cast<float>(i % 7 + 1) / 8.0f;
      scan.labels[i] = share > 0.5f ? 1 : 2;
      scan.soft.startPoint();
      scan.soft.add({1, share});
      scan.soft.add({2, 1.0f - share});
    }
  }
  return scans;
}

/// The same blocks with the same planes, to the bit.
void expectSame(const SemanticMap& a, const SemanticMap& b, const std::string& what) {
  ASSERT_GT(a.size(), 0u) << what;
  ASSERT_EQ(a.size(), b.size()) << what;
  for (const auto& entry : a.entries()) {
    const Block* other = b.find(entry.index);
    ASSERT_NE(other, nullptr) << what;
    ASSERT_EQ(entry.block->classes(), other->classes()) << what;
    for (std::size_t p = 0; p < other->classes().size(); ++p) {
      ASSERT_EQ(0, std::memcmp(entry.block->plane(p), other->plane(p), kBlockVoxels * sizeof(EvidenceUnits)))
          << what;
    }
  }
}

void expectSameLooks(const SemanticMap& a, const SemanticMap& b, const std::string& what) {
  for (const auto& [index, block] : a.entries()) {
    ASSERT_TRUE(block->looks() == b.find(index)->looks()) << what;
  }
}

TEST(Laws, OrderAndMergingChangeNoBit) {
  std::mt19937 random(3);
  for (const auto& [name, config] : additiveConfigs()) {
    for (const bool soft : {false, true}) {
      std::vector<Scan> scans = soft ? withSoftLabels(someScans()) : someScans();
      const std::string what = name + (soft ? ", soft labels" : "");
      const SemanticMap forth = mapOf(scans, config);
      std::shuffle(scans.begin(), scans.end(), random);
      const SemanticMap shuffled = mapOf(scans, config);
      expectSame(forth, shuffled, what + ", order");
      expectSameLooks(forth, shuffled, what + ", order");
      const auto middle = scans.begin() + 3;
      SemanticMap sum = mapOf({middle, scans.end()}, config);
      sum.add(mapOf({scans.begin(), middle}, config));
      expectSame(forth, sum, what + ", sum of two maps");
      expectSameLooks(forth, sum, what + ", sum of two maps");
    }
  }
}

TEST(Laws, WithdrawnScansLeaveNoTrace) {
  std::mt19937 random(4);
  for (const auto& [name, config] : additiveConfigs()) {
    for (const bool soft : {false, true}) {
      const std::vector<Scan> scans = soft ? withSoftLabels(someScans()) : someScans();
      const std::string what = name + (soft ? ", soft labels" : "");
      SemanticMapper mapper(config, reference::smallTable());
      std::vector<std::size_t> present;  // scans in the map, which may be there twice
      for (int step = 0; step < 30; ++step) {
        const bool add = present.empty() || random() % 5 < 3;
        const std::size_t n = random() % (add ? scans.size() : present.size());
        const ScanStats stats = add ? mapper.integrate(scans[n]) : mapper.withdraw(scans[present[n]]);
        EXPECT_EQ(stats.saturated + stats.negative, 0u) << what;
        if (add) {
          present.push_back(n);
        } else {
          present.erase(present.begin() + static_cast<std::ptrdiff_t>(n));
        }
        ASSERT_EQ(mapper.mapBytes(), mapper.map().bytes()) << what;
      }
      std::vector<Scan> left;
      for (const std::size_t n : present) left.push_back(scans[n]);
      expectSame(mapOf(left, config), mapper.map(), what);
      for (const Scan& scan : left) mapper.withdraw(scan);
      EXPECT_EQ(mapper.map().size(), 0u) << what;
    }
  }
}

TEST(Laws, WithdrawnScansReturnTheirMemory) {
  const auto blockBytes = [](const SemanticMap& map) {
    std::size_t sum = 0;
    for (const auto& entry : map.entries()) sum += entry.block->bytes();
    return sum;
  };
  MapperConfig config = configOf("line");
  config.occlusion = OcclusionExtent::kNone;
  const std::vector<Scan> scans = someScans();
  SemanticMapper mapper(config, reference::smallTable());
  mapper.integrate(scans[0]);
  const std::size_t before = blockBytes(mapper.map());
  mapper.integrate(scans[1]);
  EXPECT_GT(blockBytes(mapper.map()), before);
  mapper.withdraw(scans[1]);
  EXPECT_LE(blockBytes(mapper.map()), before);
}

TEST(Laws, WithdrawingWhatIsNotThereIsCountedAndReadsAsNothing) {
  MapperConfig config = configOf("line");
  config.occlusion = OcclusionExtent::kNone;
  const std::vector<Scan> scans = someScans();
  SemanticMapper mapper(config, reference::smallTable());
  EXPECT_GT(mapper.withdraw(scans[0]).negative, 0u);
  for (const auto& entry : mapper.map().entries()) {
    for (int v = 0; v < kBlockVoxels; ++v) {
      ASSERT_EQ(viewVoxel(mapper.map(), mapper.rules(), entry.index, *entry.block, v).state,
                VoxelState::kUnknown);
    }
  }
  mapper.integrate(scans[0]);
  EXPECT_EQ(mapper.map().size(), 0u) << "the sum of a scan and its withdrawal";
}

TEST(Laws, NothingIsWithdrawnWhereOrderMatters) {
  const Scan scan = someScans().front();
  for (const bool occlusion : {false, true}) {
    MapperConfig config = configOf("line");
    config.occlusion = occlusion ? OcclusionExtent::kMapped : OcclusionExtent::kNone;
    config.free_space.extent = occlusion ? FreeSpaceExtent::kObserved : FreeSpaceExtent::kMapped;
    SemanticMapper mapper(config, reference::smallTable());
    mapper.integrate(scan);
    const SemanticMap before = mapOf({scan}, config);
    const std::string why = refusalOf<std::logic_error>([&] { mapper.withdraw(scan); });
    EXPECT_NE(why.find(occlusion ? "occlusion" : "free_space/extent"), std::string::npos) << why;
    EXPECT_NE(why.find("; set "), std::string::npos) << why;
    expectSame(before, mapper.map(), "refused");
  }
}

TEST(Laws, ShiftingTheSceneByBlocksShiftsTheMap) {
  for (const std::string& mode : kModes) {
    MapperConfig config = configOf(mode);
    config.resolution = 0.25;  // so that 40 blocks are exactly 80 m
    config.downsample_resolution = 0.125;
    std::vector<Scan> scans = someScans(), shifted = scans;
    for (Scan& scan : shifted) scan.origin += Eigen::Vector3d(80.0, -160.0, 2.0);
    expectNear(mapOf(scans, config), mapOf(shifted, config), {{40, -80, 1}}, mode);
  }
}

TEST(Laws, AModeChangesOnlyFree) {
  const SemanticMap none = mapOf(someScans(), configOf("none"));
  for (const std::string& mode : kModes) {
    const SemanticMap other = mapOf(someScans(), configOf(mode));
    std::size_t changed = 0;
    std::int64_t free = 0;
    compare(other, none, {}, [&](ClassId label, EvidenceUnits x, EvidenceUnits y) {
      changed += label != kFreeClass && x != y;
      if (label == kFreeClass) free += x;
    });
    compare(none, other, {}, [&](ClassId label, EvidenceUnits x, EvidenceUnits y) {
      changed += label != kFreeClass && x != y;
    });
    EXPECT_EQ(changed, 0u) << mode;
    EXPECT_EQ(free > 0, mode != "none") << mode;
  }
}

TEST(Laws, ModesDiffer) {
  // Each mode, weight and extent gives a different map.
  std::vector<SemanticMap> maps;
  for (const std::string& mode : kModes) {
    if (mode != "line") maps.push_back(mapOf(someScans(), configOf(mode)));
  }
  for (const BeamWeight weight : {BeamWeight::kUniform, BeamWeight::kLinear, BeamWeight::kBilinear}) {
    for (const FreeSpaceExtent extent : {FreeSpaceExtent::kMapped, FreeSpaceExtent::kObserved}) {
      MapperConfig config = configOf("line");
      config.free_space.weight = weight;
      config.free_space.extent = extent;
      maps.push_back(mapOf(someScans(), config));
    }
  }
  for (std::size_t i = 0; i < maps.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      double difference = 0.0;
      const auto add = [&](ClassId, EvidenceUnits x, EvidenceUnits y) {
        difference += static_cast<double>(std::abs(evidenceOf(x) - evidenceOf(y)));
      };
      compare(maps[i], maps[j], {}, add);
      compare(maps[j], maps[i], {}, add);
      EXPECT_GT(difference, 1e-3) << i << " and " << j;
    }
  }
}

TEST(Laws, ExtentsAgreeWhereBothClear) {
  MapperConfig observed = configOf("line"), mapped = configOf("line");
  mapped.free_space.extent = FreeSpaceExtent::kMapped;
  const std::vector<Scan> scan = {someScans().front()};
  const SemanticMap all = mapOf(scan, observed), some = mapOf(scan, mapped);
  EXPECT_LT(some.size(), all.size());
  compare(some, all, {}, [](ClassId, EvidenceUnits x, EvidenceUnits y) { ASSERT_EQ(x, y); });
}

TEST(Laws, EveryBlockKnowsSomething) {
  for (const std::string& mode : kModes) {
    const SemanticMap map = mapOf(someScans(), configOf(mode));
    for (const auto& entry : map.entries()) EXPECT_FALSE(entry.block->empty()) << mode;
  }
}

TEST(Laws, ProbabilitiesSumToOne) {
  // The probability that is read, and those of all other classes and of free, by Equation 10.
  const SemanticMap map = mapOf(someScans(), configOf("line"));
  std::size_t occupied = 0;
  for (const auto& entry : map.entries()) {
    for (int v = 0; v < kBlockVoxels; ++v) {
      const VoxelView view = viewVoxel(map, StateRules(), entry.index, *entry.block, v);
      double others = 0.0, sum = 0.0;
      for (const int label : {0, 1, 2, 3, 255}) {
        const EvidenceUnits* plane = entry.block->evidence(static_cast<ClassId>(label));
        const double alpha = map.prior() + (plane ? evidenceOf(plane[v]) : 0.0f);
        if (label != view.label) others += alpha;
        sum += alpha;
      }
      ASSERT_NEAR(view.probability + others / sum, 1.0, 1e-5);
      occupied += view.state == VoxelState::kOccupied;
    }
  }
  EXPECT_GT(occupied, 100u);
}

TEST(Laws, AnEmptyScanAndAResetLeaveNothing) {
  SemanticMapper mapper(configOf("line"), reference::smallTable());
  const ScanStats stats = mapper.integrate(Scan());
  EXPECT_EQ(stats.hits, 0u);
  EXPECT_EQ(mapper.map().size(), 0u);
  mapper.integrate(someScans().front());
  EXPECT_GT(mapper.map().size(), 0u);
  mapper.reset();
  EXPECT_EQ(mapper.map().size(), 0u);
}

TEST(Laws, ARefusedReconfigurationChangesNothing) {
  MapperConfig config = configOf("line");
  SemanticMapper mapper(config, reference::smallTable()), untouched(config, reference::smallTable());
  mapper.integrate(someScans()[0]);
  untouched.integrate(someScans()[0]);
  config.kernel.length = 73 * config.resolution;
  EXPECT_THROW(SemanticMapper(config, reference::smallTable()), std::invalid_argument);
  EXPECT_THROW(mapper.reconfigure(config), std::invalid_argument);
  EXPECT_EQ(mapper.config().kernel.length, configOf("line").kernel.length);
  mapper.integrate(someScans()[1]);
  untouched.integrate(someScans()[1]);
  expectSame(untouched.map(), mapper.map(), "after a refusal");
}

TEST(Laws, AReconfiguredMapperMapsOnAsOneMadeThatWay) {
  const std::vector<Scan> scans = someScans();
  MapperConfig other = configOf("linear");
  other.sensor_model.max_range = 2.0;
  other.scan_rules.hits_before_misses = true;
  SemanticMapper changed(configOf("line"), reference::smallTable()), made(other, reference::smallTable());
  changed.integrate(scans[0]);
  changed.reset();
  changed.reconfigure(other);
  for (const Scan& scan : scans) {
    changed.integrate(scan);
    made.integrate(scan);
  }
  std::size_t differences = 0;
  compare(made.map(), changed.map(), {{0, 0, 0}},
          [&](ClassId, EvidenceUnits x, EvidenceUnits y) { differences += x != y; });
  EXPECT_EQ(differences, 0u);
  EXPECT_EQ(made.map().size(), changed.map().size());

  MapperConfig refused = other;
  refused.resolution = 0.7;
  EXPECT_THROW(changed.reconfigure(refused), std::invalid_argument);
  refused = other;
  refused.free_space.mode = "liner";
  EXPECT_THROW(changed.reconfigure(refused), std::invalid_argument);
  EXPECT_EQ(changed.config().resolution, other.resolution);
  EXPECT_EQ(changed.config().free_space.mode, "linear");
}

TEST(Laws, BytesAndChangedBlocksAreKeptUpWithTheMap) {
  for (const std::string& mode : kModes) {
    SemanticMapper mapper(configOf(mode), reference::smallTable());
    SemanticMap before = mapOf({}, configOf(mode));
    for (const Scan& scan : someScans()) {
      mapper.integrate(scan);
      EXPECT_EQ(mapper.mapBytes(), mapper.map().bytes()) << mode;
      std::set<std::tuple<int, int, int>> touched;
      for (const GridIndex& b : mapper.touchedBlocks()) {
        EXPECT_TRUE(touched.emplace(b.x, b.y, b.z).second) << "a block is listed twice";
      }
      // Blocks that are not listed are unchanged.
      for (const auto& entry : mapper.map().entries()) {
        if (touched.count({entry.index.x, entry.index.y, entry.index.z}) > 0) continue;
        const Block* old = before.find(entry.index);
        ASSERT_TRUE(old) << mode;
        ASSERT_EQ(old->classes(), entry.block->classes()) << mode;
        for (std::size_t c = 0; c < old->classes().size(); ++c) {
          ASSERT_EQ(0,
                    std::memcmp(old->plane(c), entry.block->plane(c), kBlockVoxels * sizeof(EvidenceUnits)));
        }
      }
      before.clear();
      before.add(mapper.map());
    }
    const std::size_t size = mapper.map().size();
    const auto gone = mapper.eraseBlocks([](const BlockIndex& b) { return b.x < 0; });
    EXPECT_GT(gone.size(), 0u);
    EXPECT_EQ(mapper.map().size(), size - gone.size());
    for (const auto& entry : mapper.map().entries()) EXPECT_GE(entry.index.x, 0);
    EXPECT_EQ(mapper.mapBytes(), mapper.map().bytes()) << mode;
    mapper.reset();
    EXPECT_EQ(mapper.mapBytes(), 0u);
  }
}

TEST(Laws, NeighbourhoodsAreAskedByTheFlagsOfClasses) {
  std::vector<SemanticClass> classes = reference::smallTable()->classes();  // the first is unlabelled
  MapperConfig config;
  config.rules.enabled = true;
  const auto asking = [&] {
    const SemanticMapper mapper(config, std::make_shared<ClassTable>("flags", classes));
    EXPECT_EQ(mapper.rules().neighbourhoodReach(), 3);
    std::vector<int> asked;
    for (const SemanticClass& c : classes) {
      if (mapper.rules().asksNeighbourhood(c.id)) asked.push_back(c.id);
    }
    return std::pair(asked, mapper.rules().neighbourhoodIsBelow());
  };
  std::vector<int> labelled;
  for (std::size_t n = 1; n < classes.size(); ++n) labelled.push_back(classes[n].id);
  EXPECT_EQ(asking(), std::pair(labelled, false)) << "nothing says what can move";
  classes[2].dynamic = true;
  EXPECT_EQ(asking(), std::pair(std::vector<int>{classes[2].id}, true)) << "what can be parked";
  classes[2].living = true;
  EXPECT_EQ(asking(), std::pair(std::vector<int>{}, true));
}

TEST(Laws, GainsFollowTheFlagsOfClasses) {
  std::vector<SemanticClass> classes = reference::smallTable()->classes();
  classes[2].dynamic = true;
  MapperConfig config;
  const auto rulesOf = [&] {
    return SemanticMapper(config, std::make_shared<ClassTable>("flags", classes)).rules();
  };
  for (const int id : {0, 1, 2})
    EXPECT_EQ(rulesOf().freeGain(static_cast<ClassId>(id), 0.0f), 1.0f) << "the paper's";
  config.rules.enabled = true;
  config.rules.stands_after = 4.0;
  config.rules.living_stands_after = 8.0;
  const auto hits = [&](double scans) { return static_cast<float>(scans * RulesConfig::kHit); };
  EXPECT_EQ(rulesOf().freeGain(0, 0.0f), 1.0f) << "what is unlabelled";
  EXPECT_EQ(rulesOf().freeGain(1, hits(0.1)), 0.0f) << "what cannot move stays";
  config.rules.fixed_stands_after = 2.0;
  EXPECT_EQ(rulesOf().freeGain(1, hits(1.0)), 3.0f) << "once two scans have hit it";
  EXPECT_EQ(rulesOf().freeGain(1, hits(2.0)), 0.0f);
  EXPECT_FALSE(rulesOf().canLeave(1));
  classes[1].ground = true;
  EXPECT_EQ(rulesOf().freeGain(1, hits(1.0)), 0.0f) << "ground at once";
  classes[1].ground = false;
  config.rules.fixed_stands_after = 1.0;
  EXPECT_GT(rulesOf().freeGain(2, hits(3.0)), 1000.0f) << "it may pass";
  EXPECT_EQ(rulesOf().freeGain(2, hits(4.0)), 1.0f) << "it stands";
  EXPECT_EQ(rulesOf().freeGain(kFreeClass, 5.0f), 1.0f);
  EXPECT_EQ(rulesOf().staysFrom(), 160 / 16 * rulesOf().mostVote());
  config.resolution = 0.6;  // 4 * 2^1.25 - 1/2 are 9.01 hits
  EXPECT_GT(rulesOf().freeGain(2, hits(9.0)), 1000.0f);
  EXPECT_EQ(rulesOf().freeGain(2, hits(9.1)), 1.0f);
  config.resolution = 0.3;
  classes[2].living = true;
  EXPECT_GT(rulesOf().freeGain(2, hits(7.0)), 1000.0f);
  EXPECT_EQ(rulesOf().freeGain(2, hits(8.0)), 1.0f);
  EXPECT_FALSE(rulesOf().isFixed(0)) << "what is unlabelled may move";
  EXPECT_TRUE(rulesOf().isFixed(1));
  EXPECT_FALSE(rulesOf().isFixed(2) || rulesOf().isFixed(kFreeClass));
  classes[2].free_gain = 7.0;
  EXPECT_EQ(rulesOf().freeGain(2, 5.0f), 7.0f) << "its own";
  classes[2].free_gain.reset();
  classes[2].dynamic = classes[2].living = false;
  EXPECT_GT(rulesOf().freeGain(1, hits(1.0)), 13.0f) << "all may";
  EXPECT_EQ(rulesOf().freeGain(1, hits(2.0)), 1.0f);
  EXPECT_EQ(rulesOf().freeGain(0, hits(1.0)), 1.0f) << "but what is unlabelled";
  config.rules.stands_after = 1.0;
  EXPECT_EQ(rulesOf().freeGain(1, hits(1.0)), 1.0f) << "fewer scans than two";
}

}  // namespace
}  // namespace bki_mapping
