/// @file Sets of voxels of one block.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// One bit for each voxel of a block, by GridGeometry::offsetInBlock.
using VoxelMask = std::bitset<kBlockVoxels>;

/// The same as one word for each layer along z, for loops over words: bit v of word n is voxel 64 n + v.
using LayerBits = std::array<std::uint64_t, kBlockEdge>;

static_assert(kBlockEdge * kBlockEdge == 64 && sizeof(VoxelMask) == sizeof(LayerBits) &&
                  std::is_trivially_copyable_v<VoxelMask> && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "a VoxelMask must be copied bit by bit here");

inline LayerBits bitsOf(const VoxelMask& mask) {
  LayerBits bits;
  std::memcpy(&bits, &mask, sizeof(bits));
  return bits;
}
inline VoxelMask maskOf(const LayerBits& bits) {
  VoxelMask mask;
  std::memcpy(static_cast<void*>(&mask), &bits, sizeof(bits));
  return mask;
}

/// visit(offset) for each voxel of the mask, by rising offset.
template <typename Visit>
void forEachVoxelOf(const VoxelMask& mask, const Visit& visit) {
  const LayerBits bits = bitsOf(mask);
  for (std::size_t layer = 0; layer < bits.size(); ++layer) {
    for (std::uint64_t left = bits[layer]; left != 0; left &= left - 1) {
      visit(64 * layer + static_cast<std::size_t>(__builtin_ctzll(left)));
    }
  }
}

}  // namespace bki_mapping
