// Once its memory has grown to the size of the scans, mapping allocates nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "reference/scenes.h"

namespace {

std::atomic<std::size_t> allocations{0};

void* countedAllocation(std::size_t size, std::size_t alignment) {
  ++allocations;
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (!memory) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) {
  return countedAllocation(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return countedAllocation(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace bki_mapping {
namespace {

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
  ::operator delete(::operator new(1));  // compilers may leave out `delete new int`
  EXPECT_EQ(allocations - before, 1u);
}

TEST(Allocation, NoneInTheSteadyState) {
  const Scan scan = everywhere();
  for (const char* mode : {"none", "even", "uniform", "linear", "line"}) {
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

TEST(Allocation, NoneInTheSteadyStateOfTwoThreads) {
  // Which thread takes which block is chance, so that a thread's memory may grow late, but not for ever.
  const Scan scan = everywhere();
  MapperConfig config;
  config.threads = 2;
  SemanticMapper mapper(config, reference::smallTable());
  for (int time = 0; time < 50; ++time) mapper.integrate(scan);
  std::size_t quiet = 0;
  for (int time = 0; time < 20; ++time) quiet += allocationsOf(mapper, scan) == 0;
  EXPECT_GE(quiet, 15u);
}

}  // namespace
}  // namespace bki_mapping
