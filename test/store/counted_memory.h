/// @file Counts the memory that a program takes. To be included in one file of a program.
#pragma once

#include <malloc.h>
#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

#include "store/tile_codec.h"

namespace {

std::atomic<std::ptrdiff_t> allocated_bytes{0}, most_bytes{0};

// Not inline: GCC would take malloc for another allocator than the one that it replaces.
[[gnu::noinline]] void* countedAllocation(std::size_t size) noexcept {
  void* const memory = std::malloc(size);
  if (!memory) return nullptr;
  allocated_bytes += static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  most_bytes = std::max<std::ptrdiff_t>(most_bytes, allocated_bytes);
  return memory;
}

}  // namespace

void* operator new(std::size_t size) {
  void* const memory = countedAllocation(size);
  if (!memory) throw std::bad_alloc();
  return memory;
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return countedAllocation(size);
}
void operator delete(void* memory) noexcept {
  allocated_bytes -= static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  operator delete(memory);
}

namespace bki_mapping {
namespace {

/// The memory that C++ and SQLite had taken at most since the object was made [bytes].
class PeakMemory {
 public:
  PeakMemory() : before_(allocated_bytes) {
    most_bytes = before_;
    sqlite3_memory_highwater(1);
  }
  std::ptrdiff_t bytes() const {
    return most_bytes - before_ + static_cast<std::ptrdiff_t>(sqlite3_memory_highwater(0));
  }

 private:
  std::ptrdiff_t before_;
};

/// For reading a whole file.
inline std::ptrdiff_t memoryLimit(std::size_t file_size) {
  return 8'000'000 + static_cast<std::ptrdiff_t>(2 * TileCodec::kMemoryPerByte * file_size);
}

}  // namespace
}  // namespace bki_mapping
