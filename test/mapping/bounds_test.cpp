// Far points, fine voxels and long beams take bounded memory and time, or are refused with a message, and the
// map stays unchanged.
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <limits>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "free_space/free_space_model.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A round room about the sensor, with a radius of 10 m and walls 3 m high.
Scan room(std::size_t points = 2000) {
  Scan scan;
  for (std::size_t i = 0; i < points; ++i) {
    const float angle = 0.01f * static_cast<float>(i), height = 0.03f * static_cast<float>(i % 100) - 1.0f;
    scan.points.emplace_back(10.0f * std::cos(angle), 10.0f * std::sin(angle), height);
    scan.labels.push_back(10);
  }
  scan.stamp = 1;
  return scan;
}

Scan roomWithOnePointAt(const Eigen::Vector3f& point) {
  Scan scan = room();
  scan.points[1000] = point;
  return scan;
}

/// Resident memory of this process [MB].
double residentMemory() {
  std::ifstream in("/proc/self/statm");
  double pages = 0.0;
  in >> pages >> pages;
  return pages * 4096e-6;
}

/// Peak of the resident memory since the last forgetPeak() [MB].
double peakMemory() {
  std::ifstream in("/proc/self/status");
  for (std::string word; in >> word;) {
    double kilobytes = 0.0;
    if (word == "VmHWM:" && in >> kilobytes) return 1e-3 * 1.024 * kilobytes;
  }
  ADD_FAILURE() << "the system does not report the peak of resident memory";
  return 0.0;
}
void forgetPeak() {
  std::ofstream("/proc/self/clear_refs") << 5;
}

bool equal(const SemanticMap& a, const SemanticMap& b) {
  if (a.size() != b.size()) return false;
  for (const auto& entry : a.entries()) {
    const Block* other = b.find(entry.index);
    if (!other || other->classes() != entry.block->classes()) return false;
    for (std::size_t c = 0; c < other->classes().size(); ++c) {
      if (!std::equal(other->plane(c), other->plane(c) + kBlockVoxels, entry.block->plane(c))) return false;
    }
  }
  return true;
}

std::string refusalOf(SemanticMapper& mapper, const Scan& scan, ScanRefused::Reason reason) {
  try {
    mapper.integrate(scan);
  } catch (const ScanRefused& refused) {
    EXPECT_EQ(refused.reason(), reason);
    return refused.what();
  }
  ADD_FAILURE() << "the scan was not refused";
  return "";
}

bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

TEST(Bounds, OneFarPointIsLeftOut) {
  for (const std::string& mode : freeSpaceModes()) {
    MapperConfig config;
    config.free_space.mode = mode;
    config.occlusion = OcclusionExtent::kAll;
    SemanticMapper with(config, reference::smallTable()), without(config, reference::smallTable());
    Scan good = room();
    good.points.erase(good.points.begin() + 1000);
    good.labels.pop_back();
    without.integrate(good);
    for (const float distance : {301.0f, 1e6f, 1e7f, 1e12f, 1e30f}) {
      with.reset();
      const ScanStats stats = with.integrate(roomWithOnePointAt({distance, 0.3f * distance, 1.0f}));
      EXPECT_EQ(stats.counts.beyond_max, 1u) << mode << " " << distance;
      EXPECT_EQ(with.map().size(), without.map().size()) << mode << " " << distance;
    }
  }
}

TEST(Bounds, AHitWithinTheDefaultReachIsMapped) {
  SemanticMapper mapper(MapperConfig(), reference::smallTable());
  const ScanStats stats = mapper.integrate(roomWithOnePointAt({299.0f, 0.0f, 1.0f}));
  EXPECT_EQ(stats.counts.used, 2000u);
  EXPECT_EQ(viewPoint(mapper.map(), mapper.rules(), {299.0, 0.0, 1.0}).state, VoxelState::kOccupied);
}

TEST(Bounds, AScanOfTooManyBlocksIsRefusedAndTheNextIsMapped) {
  for (const char* mode : {"even", "line"}) {
    for (const float distance : {1e6f, 1.5e7f, 2.6e7f}) {
      MapperConfig config;
      config.free_space.mode = mode;
      config.sensor_model.max_range = 1e9;
      SemanticMapper mapper(config, reference::smallTable()), expected(config, reference::smallTable());
      mapper.integrate(room());
      expected.integrate(room());
      const double memory = residentMemory();
      forgetPeak();
      const auto start = std::chrono::steady_clock::now();
      const std::string why = refusalOf(mapper, roomWithOnePointAt({distance, 0.3f * distance, 1.0f}),
                                        ScanRefused::Reason::kTooLarge);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      EXPECT_TRUE(has(why, "raise scan_limit/blocks") || has(why, "raise free_space/gap")) << why;
      EXPECT_LT(took.count(), 30.0);
      EXPECT_LT(peakMemory(), memory + 300.0);
      EXPECT_LT(residentMemory(), memory + 100.0);
      EXPECT_TRUE(equal(mapper.map(), expected.map()));
      EXPECT_EQ(mapper.mapBytes(), mapper.map().bytes());
      Scan next = room(1500);
      next.stamp = 2;
      mapper.integrate(next);
      expected.integrate(next);
      EXPECT_TRUE(equal(mapper.map(), expected.map()));
    }
  }
}

TEST(Bounds, ScanLimitBlocksIsObeyed) {
  for (const OcclusionExtent occlusion : {OcclusionExtent::kNone, OcclusionExtent::kAll}) {
    MapperConfig config;
    config.occlusion = occlusion;
    SemanticMapper free(config, reference::smallTable());
    const auto blocks = static_cast<std::int64_t>(free.integrate(room()).blocks);
    config.scan_limit.blocks = blocks;
    SemanticMapper enough(config, reference::smallTable());
    EXPECT_NO_THROW(enough.integrate(room()));
    config.scan_limit.blocks = 3;
    SemanticMapper few(config, reference::smallTable());
    refusalOf(few, room(), ScanRefused::Reason::kTooLarge);
    EXPECT_EQ(few.map().size(), 0u);
  }
}

TEST(Bounds, FineVoxelsAreRefusedWithAnEstimate) {
  for (const double length : {0.0, 0.3}) {
    MapperConfig config;
    config.resolution = 0.005;
    config.downsample_resolution = 0.005;
    config.kernel.length = length;
    SemanticMapper mapper(config, reference::smallTable());
    const double memory = residentMemory();
    forgetPeak();
    const std::string why = refusalOf(mapper, room(60000), ScanRefused::Reason::kTooLarge);
    EXPECT_TRUE(has(why, "0.005 m") && has(why, " MB") && has(why, "coarser resolution")) << why;
    EXPECT_LT(peakMemory(), memory + 300.0);
    EXPECT_EQ(mapper.map().size(), 0u);
  }
}

TEST(Bounds, TooManySamplesAreRefused) {
  MapperConfig config;
  config.free_space.mode = "even";
  config.free_space.gap = 0.01;
  config.downsample_resolution = 0.0;
  SemanticMapper even(config, reference::smallTable());
  const std::string why = refusalOf(even, room(60000), ScanRefused::Reason::kTooLarge);
  EXPECT_TRUE(has(why, "60.") && has(why, "million free-space samples") && has(why, "free_space/gap")) << why;
  config.free_space.mode = "linear";
  config.free_space.samples_per_beam = 1000;
  SemanticMapper linear(config, reference::smallTable());
  refusalOf(linear, room(60000), ScanRefused::Reason::kTooLarge);
}

TEST(Bounds, TheMapKeepsToItsMemoryLimit) {
  MapperConfig config;
  config.memory_limit = 3.0;
  SemanticMapper mapper(config, reference::smallTable());
  Scan scan = room();
  std::string why;
  std::size_t integrated = 0, blocks = 0;
  for (int n = 0; n < 40; ++n, scan.origin.x() += 5.0) {
    try {
      mapper.integrate(scan);
      ++integrated;
      blocks = mapper.map().size();
    } catch (const ScanRefused& refused) {
      why = refused.what();
      EXPECT_EQ(refused.reason(), ScanRefused::Reason::kMemory);
      EXPECT_EQ(mapper.map().size(), blocks) << "a refused scan leaves nothing";
    }
    EXPECT_LT(static_cast<double>(mapper.mapBytes()), 1.1e6 * config.memory_limit);
    EXPECT_EQ(mapper.mapBytes(), mapper.map().bytes());
  }
  EXPECT_GT(integrated, 2u);
  EXPECT_LT(integrated, 40u);
  EXPECT_TRUE(has(why, "memory_limit, 3 MB; raise memory_limit")) << why;
  config.memory_limit = 0.0;
  mapper.reconfigure(config);
  EXPECT_NO_THROW(mapper.integrate(scan));
}

TEST(Bounds, ResetGivesMemoryBackToTheSystem) {
  SemanticMapper mapper(MapperConfig(), reference::smallTable());
  mapper.integrate(room());
  const double before = residentMemory();
  Scan scan = room();
  for (int n = 0; n < 600; ++n, scan.origin.x() += 25.0) mapper.integrate(scan);
  const double full = residentMemory();
  EXPECT_GT(full, before + 100.0);
  mapper.reset();
  EXPECT_LT(residentMemory(), before + 0.1 * (full - before));
  EXPECT_EQ(mapper.mapBytes(), 0u);
}

TEST(Bounds, BeamsCutWhereTheMapEndsAreLeftOut) {
  for (const char* mode : {"even", "linear", "line"}) {
    MapperConfig config;
    config.free_space.mode = mode;
    config.downsample_resolution = 0.0;
    config.sensor_model.max_range = 100.0;
    config.occlusion = OcclusionExtent::kAll;
    SemanticMapper mapper(config, reference::smallTable());
    Scan scan;
    const double edge = GridGeometry::kMaxCoordinate * config.resolution;
    scan.origin = {edge - 50.0, 0.0, 0.0};
    scan.points = {{200.0f, 0.0f, 0.0f}, {-200.0f, 0.0f, 0.0f}, {3.0f, 0.0f, 0.0f}};
    scan.labels = {10, 10, 10};
    scan.no_returns = {{1.0f, 0.0f, 0.0f}, {-1.0f, 0.1f, 0.0f}};
    const ScanStats stats = mapper.integrate(scan);
    EXPECT_EQ(stats.counts.beyond_max, 2u);
    EXPECT_EQ(stats.counts.no_returns, 2u);
    for (const auto& entry : mapper.map().entries()) {
      EXPECT_LE(mapper.map().geometry().blockOrigin(entry.index).x(), edge) << mode;
    }
    // With this range no cut beam ends inside the map.
    Scan far = scan;
    far.sensor_model = SensorModelConfig{0.0, 1e9};
    scan.points = {{-200.0f, 0.0f, 0.0f}, {3.0f, 0.0f, 0.0f}};
    EXPECT_EQ(mapper.integrate(far).counts.used, 2u) << "hits inside the map are used";
  }
}

TEST(Kernel, FollowsTheResolutionUnlessItIsSet) {
  for (const double resolution : {0.1, 0.3, 1.0, 2.0, 5.0}) {
    MapperConfig config;
    config.resolution = resolution;
    config.free_space.mode = "none";
    SemanticMapper mapper(config, reference::smallTable());
    const Scan scan = room();
    mapper.integrate(scan);
    std::size_t occupied = 0;
    for (const Eigen::Vector3f& point : scan.points) {
      occupied +=
          viewPoint(mapper.map(), mapper.rules(), point.cast<double>()).state == VoxelState::kOccupied;
    }
    EXPECT_EQ(occupied, scan.points.size()) << resolution;
  }
}

TEST(Kernel, AShortLengthIsWarnedOf) {
  MapperConfig config;
  EXPECT_TRUE(settingWarnings(config).empty());
  config.resolution = 1.0;
  EXPECT_TRUE(settingWarnings(config).empty());
  config.kernel.length = 0.3;
  ASSERT_EQ(settingWarnings(config).size(), 1u);
  EXPECT_TRUE(has(settingWarnings(config)[0], "kernel/length 0.3 m")) << settingWarnings(config)[0];
  EXPECT_TRUE(has(settingWarnings(config)[0], "diagonal, 0.866 m")) << settingWarnings(config)[0];
  config.kernel.type = KernelType::kCounting;
  EXPECT_TRUE(settingWarnings(config).empty());
}

TEST(Rules, WithoutWholeBeamsAreToldOf) {
  MapperConfig config;
  config.rules.enabled = true;
  EXPECT_TRUE(settingWarnings(config).empty());
  config.free_space.mode = "linear";
  ASSERT_EQ(settingWarnings(config).size(), 1u);
  EXPECT_TRUE(has(settingWarnings(config)[0], "set free_space/mode to line")) << settingWarnings(config)[0];
}

TEST(Rules, WithoutAGroundAreToldOf) {
  MapperConfig config;
  config.rules.enabled = true;
  std::vector<SemanticClass> classes = reference::smallTable()->classes();
  for (SemanticClass& c : classes) c.ground = false;
  const auto warnings = [&] { return settingWarnings(config, ClassTable("flat", classes)); };
  ASSERT_EQ(warnings().size(), 1u);
  EXPECT_TRUE(has(warnings()[0], "set sensor_model/height")) << warnings()[0];
  config.sensor_model.height = 0.4;
  EXPECT_TRUE(warnings().empty());
  config.sensor_model.height = 0.0;
  classes[1].ground = true;
  EXPECT_TRUE(warnings().empty());
}

TEST(Kernel, LimitsOfItsLengthDoNotHoldForCounting) {
  MapperConfig config;
  config.kernel.length = 100.0;
  EXPECT_THROW(SemanticMapper(config, reference::smallTable()), std::invalid_argument);
  config.kernel.type = KernelType::kCounting;
  SemanticMapper mapper(config, reference::smallTable());
  mapper.integrate(room());
  EXPECT_GT(mapper.map().size(), 0u);
}

TEST(Bounds, SharesThatAreNoProbabilitiesAreCounted) {
  Scan scan;
  scan.labels_are_ids = true;
  const float bad[] = {0.0f, -0.5f, std::numeric_limits<float>::quiet_NaN(), kInfinity, 2.0f, 3e38f};
  for (const float share : bad) {
    const auto x = static_cast<float>(scan.points.size());
    scan.points.emplace_back(2.0f + x, 0.0f, 0.0f);
    scan.labels.push_back(1);
    scan.soft.startPoint();
    scan.soft.add({1, 0.5f});
    scan.soft.add({2, share});
  }
  scan.points.emplace_back(0.0f, 3.0f, 0.0f);
  scan.labels.push_back(1);
  scan.soft.startPoint();
  scan.soft.add({1, 0.5f});
  scan.soft.add({2, 0.5f});
  SemanticMapper mapper(MapperConfig(), reference::smallTable());
  const ScanStats stats = mapper.integrate(scan);
  EXPECT_EQ(stats.counts.not_finite, std::size(bad));
  EXPECT_EQ(stats.counts.used, 1u);
  EXPECT_EQ(stats.not_finite, 0u);
  forEachKnownVoxel(mapper.map(), mapper.rules(), [](const VoxelIndex&, const VoxelView& view) {
    EXPECT_TRUE(std::isfinite(view.probability) && view.evidence > 0.0f);
  });
}

TEST(Bounds, NoSettingMakesEvidenceInfinite) {
  const char* const names[] = {"prior", "kernel/scale", "rules/void_outweighs", "rules/stands_after",
                               "rules/living_stands_after"};
  for (const char* name : names) {
    MapperConfig config;
    EXPECT_THROW(setParameters(config, {{name, "1e39"}}), std::invalid_argument) << name;
    EXPECT_THROW(setParameters(config, {{name, "inf"}}), std::invalid_argument) << name;
  }
}

}  // namespace
}  // namespace bki_mapping
