/// @file Cubes of blocks, which one thread updates in one go.
#pragma once

#include <cstdint>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// A group has 4 x 4 x 4 blocks, 32 x 32 x 32 voxels.
constexpr int kGroupEdge = 4;                          ///< [blocks]
constexpr int kGroupVoxels = kGroupEdge * kBlockEdge;  ///< of an edge

struct BlockGroup {
  GridIndex index;
  std::uint64_t blocks = 0;  ///< those that matter, each the bit of its place
};

/// The group in which a block lies.
inline GridIndex groupOf(const BlockIndex& block) {
  static_assert(kGroupEdge == 4 && -1 >> 2 == -1, "a shift divides by the edge, towards minus infinity");
  return {block.x >> 2, block.y >> 2, block.z >> 2};
}
/// The place of a block in its group, from 0 on, along one axis.
inline int placeInGroup(std::int32_t coordinate) {
  return coordinate & (kGroupEdge - 1);
}
/// The number of a place.
inline int numberInGroup(int x, int y, int z) {
  return x + kGroupEdge * (y + kGroupEdge * z);
}
inline int numberInGroup(const BlockIndex& block) {
  return numberInGroup(placeInGroup(block.x), placeInGroup(block.y), placeInGroup(block.z));
}

}  // namespace bki_mapping
