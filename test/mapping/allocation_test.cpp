// In the steady state mapping allocates nothing; and whichever allocation fails, the map holds a scan whole
// or not at all.
#include <gtest/gtest.h>

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>
#include <optional>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "free_space/free_space_model.h"
#include "reference/content.h"
#include "reference/scenes.h"

namespace {

std::atomic<std::size_t> allocations{0};
std::atomic<std::ptrdiff_t> allocated_bytes{0};
/// Number of allocations that still succeed before one fails, or, with `fails_on`, all later ones; negative:
/// none fails.
std::atomic<std::ptrdiff_t> until_failure{-1};
std::atomic<bool> fails_on{false};

bool failsNow() {
  if (until_failure < 0) return false;
  const std::ptrdiff_t left = until_failure--;
  if (left > 0) return false;
  if (fails_on) until_failure = 0;
  return true;
}

void* countedAllocation(std::size_t size, std::size_t alignment) {
  ++allocations;
  if (failsNow()) throw std::bad_alloc();
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (!memory) throw std::bad_alloc();
  allocated_bytes += static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  return memory;
}

void countedRelease(void* memory) noexcept {
  allocated_bytes -= static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  std::free(memory);
}

}  // namespace

/// Stands before the C library's. A scan that fails returns its memory to the system; to take it from there
/// again after each of thousands of failures would take most of the time of this test.
extern "C" int malloc_trim(std::size_t) noexcept {
  return 0;
}

void* operator new(std::size_t size) {
  return countedAllocation(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return countedAllocation(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  countedRelease(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  countedRelease(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  countedRelease(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  countedRelease(memory);
}

namespace bki_mapping {
namespace {

using reference::contentOf;

Scan everywhere() {
  for (const reference::Scene& scene : reference::nastyScenes(3000)) {
    if (scene.name == "everywhere") return scene.scan;
  }
  throw std::logic_error("there is no scene 'everywhere'");
}

std::size_t allocationsOf(SemanticMapper& mapper, const Scan& scan) {
  const std::size_t before = allocations;
  mapper.integrate(scan);
  return allocations - before;
}

TEST(Allocation, TheCounterCounts) {
  const std::size_t before = allocations;
  ::operator delete(::operator new(1));  // compilers may optimise `delete new int` away
  EXPECT_EQ(allocations - before, 1u);
}

TEST(Allocation, NoneInTheSteadyState) {
  const Scan scan = everywhere();
  for (const std::string& mode : freeSpaceModes()) {
    for (const FreeSpaceExtent extent : {FreeSpaceExtent::kMapped, FreeSpaceExtent::kObserved}) {
      MapperConfig config;
      config.free_space.mode = mode;
      config.free_space.extent = extent;
      config.threads = 1;
      SemanticMapper mapper(config, reference::smallTable());
      EXPECT_GT(allocationsOf(mapper, scan), 0u) << mode;
      mapper.integrate(scan);
      for (int time = 0; time < 5; ++time) EXPECT_EQ(allocationsOf(mapper, scan), 0u) << mode;
    }
  }
}

TEST(Allocation, NoneInTheSteadyStateWithRules) {
  const Scan scan = everywhere();
  for (const double height : {0.0, 1.7}) {  // found in each scan, and given
    MapperConfig config;
    config.free_space.extent = FreeSpaceExtent::kObserved;
    config.rules.enabled = true;
    config.sensor_model.height = height;
    config.threads = 1;
    for (const auto& classes : {reference::tableWithDynamicClass(), reference::smallTable()}) {
      SemanticMapper mapper(config, classes);
      for (int time = 0; time < 3; ++time) mapper.integrate(scan);
      for (int time = 0; time < 5; ++time) EXPECT_EQ(allocationsOf(mapper, scan), 0u) << height;
    }
  }
}

TEST(Allocation, NoneInTheSteadyStateWhileTimePasses) {
  Scan scan = everywhere();
  MapperConfig config;
  config.free_space.extent = FreeSpaceExtent::kObserved;
  config.rules.enabled = config.rules.latest = true;
  config.sensor_model.height = 1.7;
  config.threads = 1;
  SemanticMapper mapper(config, reference::tableWithDynamicClass());
  const auto allocationsAt = [&](std::uint64_t tick) {
    scan.stamp = ((std::uint64_t{1} << 30) + tick) << Look::kTickBits;
    return allocationsOf(mapper, scan);
  };
  // Whenever a time is twice as long as before, there is one more look.
  for (std::uint64_t tick = 0; tick < 70; ++tick) allocationsAt(tick);
  for (std::uint64_t tick = 70; tick < 120; ++tick) EXPECT_EQ(allocationsAt(tick), 0u) << tick;
  std::size_t most_looks = 0;
  for (const auto& [index, block] : mapper.map().entries()) {
    most_looks = std::max(most_looks, block->looks().size());
  }
  EXPECT_GT(most_looks, 5u);
}

TEST(Allocation, NoneInTheSteadyStateOfTwoThreads) {
  // Any thread may get any job, so that a thread's memory may grow late, but not forever.
  const Scan scan = everywhere();
  MapperConfig config;
  config.threads = 2;
  SemanticMapper mapper(config, reference::smallTable());
  for (int time = 0; time < 50; ++time) mapper.integrate(scan);
  std::size_t quiet = 0;
  for (int time = 0; time < 20; ++time) quiet += allocationsOf(mapper, scan) == 0;
  EXPECT_GE(quiet, 15u);
}

/// Lets the first allocation of a scan fail, then the second, and so on, until the scan succeeds.
/// @param on whether all later allocations fail, too. @param shared whether a snapshot shares the blocks.
void failEverywhere(const MapperConfig& config, const Scan& first, const Scan& second, bool on,
                    bool shared = false) {
  SemanticMapper whole(config, reference::smallTable()), failing(config, reference::smallTable());
  whole.integrate(first);
  failing.integrate(first);
  const auto before = contentOf(failing.map());
  std::optional<SemanticMap> snapshot;
  if (shared) snapshot = failing.snapshot().map;
  whole.integrate(second);
  const auto after = contentOf(whole.map());
  ASSERT_NE(before, after);
  std::ptrdiff_t failures = 0;
  for (bool succeeded = false; !succeeded; ++failures) {
    fails_on = on;
    until_failure = failures;
    try {
      failing.integrate(second);
      succeeded = true;
    } catch (const ScanRefused& refused) {
      EXPECT_EQ(refused.reason(), ScanRefused::Reason::kMemory);
    } catch (const std::bad_alloc&) {  // there was no memory for the message either
    }
    until_failure = -1;
    if (succeeded) break;
    ASSERT_EQ(contentOf(failing.map()), before) << "after " << failures << " allocations";
    ASSERT_EQ(failing.mapBytes(), failing.map().bytes()) << "after " << failures << " allocations";
    ASSERT_TRUE(failing.touchedBlocks().empty());
  }
  EXPECT_EQ(contentOf(failing.map()), after);
  EXPECT_EQ(failing.mapBytes(), failing.map().bytes());
  if (snapshot) {
    EXPECT_EQ(contentOf(*snapshot), before);
  }
  EXPECT_GT(failures, 50) << "too few allocations for the test to mean much";
}

Scan fewPoints(unsigned seed) {
  Scan scan = reference::nastyScenes(60)[0].scan;
  scan.origin += Eigen::Vector3d(0.9 * seed, -0.4 * seed, 0.2);
  scan.stamp += seed;
  for (std::uint32_t& label : scan.labels) label = 10u * ((label / 10 + seed) % 4);
  return scan;
}

/// The same with two classes a point.
Scan withShares(Scan scan) {
  scan.labels_are_ids = true;
  for (std::uint32_t& label : scan.labels) {
    label /= 10u;
    scan.soft.startPoint();
    scan.soft.add({static_cast<ClassId>(label), 0.75f});
    scan.soft.add({static_cast<ClassId>((label + 1) % 4), 0.25f});
  }
  return scan;
}

TEST(Allocation, AFailureAnywhereInAScanLeavesTheMapAsItWas) {
  for (const bool on : {false, true}) {
    for (const std::string& mode : freeSpaceModes()) {
      MapperConfig config;
      config.free_space.mode = mode;
      config.threads = 1;
      failEverywhere(config, fewPoints(0), fewPoints(1), on);
      config.scan_rules.hits_before_misses = true;
      config.scan_rules.most_hits = 0.2f;
      config.scan_rules.most_free = 1e-3f;
      config.scan_rules.free_threshold = 0.02f;
      config.scan_rules.void_evidence = 2.0f;
      failEverywhere(config, fewPoints(0), fewPoints(2), on);
      config.scan_rules.static_spread = false;
      failEverywhere(config, fewPoints(0), fewPoints(2), on);
    }
  }
}

TEST(Allocation, AFailureLeavesTheMapAsItWasWithEveryKindOfEvidence) {
  for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
    for (const FreeSpaceExtent extent : {FreeSpaceExtent::kMapped, FreeSpaceExtent::kObserved}) {
      for (const BeamIndexType index : {BeamIndexType::kTable, BeamIndexType::kRtree}) {
        MapperConfig config;
        config.kernel.type = kernel;
        config.free_space.extent = extent;
        config.free_space.beam_index = index;
        config.occlusion =
            extent == FreeSpaceExtent::kMapped ? OcclusionExtent::kMapped : OcclusionExtent::kAll;
        config.threads = 1;
        failEverywhere(config, fewPoints(0), fewPoints(1), false);
        failEverywhere(config, fewPoints(0), withShares(fewPoints(1)), false);
      }
    }
  }
}

TEST(Allocation, AFailureOnOneOfTwoThreadsLeavesTheMapAsItWas) {
  for (const char* mode : {"linear", "line"}) {
    MapperConfig config;
    config.free_space.mode = mode;
    config.threads = 2;
    failEverywhere(config, everywhere(), fewPoints(1), false);
    failEverywhere(config, fewPoints(1), everywhere(), false);  // the index grows, too
  }
}

TEST(Allocation, AFailureLeavesTheMapAndItsSnapshotAsTheyWere) {
  for (const char* mode : {"linear", "line"}) {
    MapperConfig config;
    config.free_space.mode = mode;
    config.threads = 1;
    for (const bool on : {false, true}) failEverywhere(config, fewPoints(0), fewPoints(1), on, true);
  }
}

TEST(Allocation, AFailureWhileAMapIsAddedLeavesBothAsTheyWere) {
  MapperConfig config;
  config.free_space.extent = FreeSpaceExtent::kObserved;
  config.threads = 1;
  Scan far = fewPoints(1);
  far.origin.x() += 100.0;  // regions that only one of the maps has
  for (const bool on : {false, true}) {
    SemanticMapper mapper(config, reference::smallTable()), other(config, reference::smallTable());
    mapper.integrate(fewPoints(0));
    for (const Scan& scan : {fewPoints(1), far}) other.integrate(scan);
    SemanticMap map = other.snapshot().map;
    const auto before = contentOf(mapper.map()), of_other = contentOf(map);
    std::ptrdiff_t failures = 0;
    for (bool succeeded = false; !succeeded; ++failures) {
      fails_on = on;
      until_failure = failures;
      try {
        mapper.addMap(std::move(map));
        succeeded = true;
      } catch (const std::bad_alloc&) {
      }
      until_failure = -1;
      if (succeeded) break;
      ASSERT_EQ(contentOf(mapper.map()), before) << "after " << failures << " allocations";
      ASSERT_EQ(contentOf(map), of_other) << "after " << failures << " allocations";
      ASSERT_EQ(mapper.mapBytes(), mapper.map().bytes()) << "after " << failures << " allocations";
    }
    SemanticMapper whole(config, reference::smallTable());
    for (const Scan& scan : {fewPoints(0), fewPoints(1), far}) whole.integrate(scan);
    EXPECT_EQ(contentOf(mapper.map()), contentOf(whole.map()));
    EXPECT_EQ(mapper.mapBytes(), mapper.map().bytes());
    EXPECT_GT(failures, 10) << "too few allocations for the test to mean much";
  }
}

TEST(Allocation, NoneInTheSteadyStateAfterASnapshotIsGone) {
  const Scan scan = everywhere();
  MapperConfig config;
  config.threads = 1;
  SemanticMapper mapper(config, reference::smallTable());
  for (int n = 0; n < 3; ++n) mapper.integrate(scan);
  {
    const MapSnapshot snapshot = mapper.snapshot();
    EXPECT_GT(allocationsOf(mapper, scan), mapper.map().size()) << "blocks are copied";
  }
  EXPECT_EQ(allocationsOf(mapper, scan), 0u);
}

TEST(Allocation, BytesOfAMapAreWhatItTakes) {
  MapperConfig config;
  config.threads = 1;
  SemanticMapper mapper(config, reference::smallTable());
  Scan scan = everywhere();
  for (int n = 0; n < 2; ++n) mapper.integrate(scan);  // working memory has its size
  const auto beside = [&] { return allocated_bytes - static_cast<std::ptrdiff_t>(mapper.map().bytes()); };
  const std::ptrdiff_t before = beside();
  for (int n = 0; n < 300; ++n) {
    scan.origin.x() += 8.1;
    mapper.integrate(scan);
  }
  const auto bytes = static_cast<double>(mapper.map().bytes());
  EXPECT_GT(bytes, 5e6);
  EXPECT_NEAR(static_cast<double>(beside() - before), 0.0, 0.02 * bytes);
}

}  // namespace
}  // namespace bki_mapping
