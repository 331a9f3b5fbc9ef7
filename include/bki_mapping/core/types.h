/// @file Small types shared by all rooms.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace bki_mapping {

/// Id of a class in the run-time class table, 0 to 253.
using ClassId = std::uint8_t;
constexpr std::size_t kMaxClasses = 254;
/// Stands for `free` wherever a class id is stored; never an id of a class table.
constexpr ClassId kFreeClass = 255;

/// Edge of a block [voxels] and the number of voxels in it.
constexpr int kBlockEdge = 8;
constexpr int kBlockVoxels = kBlockEdge * kBlockEdge * kBlockEdge;

/// Integer coordinates of a voxel, or of a block, in the map frame's grid.
struct GridIndex {
  std::int32_t x = 0, y = 0, z = 0;
  bool operator==(const GridIndex& o) const { return x == o.x && y == o.y && z == o.z; }
  bool operator!=(const GridIndex& o) const { return !(*this == o); }
  /// Lexicographic in z, y, x: the order in which files list blocks.
  bool operator<(const GridIndex& o) const { return z != o.z ? z < o.z : (y != o.y ? y < o.y : x < o.x); }
};
struct VoxelIndex : GridIndex {};
struct BlockIndex : GridIndex {};

/// Spreads the three coordinates over 64 bits: sums of products with odd constants of the golden-ratio
/// family. The high bits are mixed well; they are folded into the low ones.
struct GridIndexHash {
  std::size_t operator()(const GridIndex& i) const {
    const std::uint64_t h = static_cast<std::uint32_t>(i.x) * 0x9E3779B97F4A7C15ull +
                            static_cast<std::uint32_t>(i.y) * 0xC2B2AE3D27D4EB4Full +
                            static_cast<std::uint32_t>(i.z) * 0x165667B19E3779F9ull;
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

}  // namespace bki_mapping
