/// @file Groups of blocks: the unit of work of an update.
#pragma once

#include <cstdint>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// A group has 4 x 4 x 4 blocks, 32 x 32 x 32 voxels.
constexpr int kGroupEdge = 4;                          ///< [blocks]
constexpr int kGroupVoxels = kGroupEdge * kBlockEdge;  ///< edge [voxels]
constexpr int kGroupBlocks = kGroupEdge * kGroupEdge * kGroupEdge;
constexpr int kSlotsOfLayer = kGroupEdge * kGroupEdge;  ///< from a slot to that above it

/// A subset of the blocks of a group: bit n stands for the block in slot n.
struct BlockGroup {
  GridIndex index;
  std::uint64_t blocks = 0;
};

/// The group that contains a block.
inline GridIndex groupOf(const BlockIndex& block) {
  static_assert(kGroupEdge == 4 && -1 >> 2 == -1, "a shift divides by the edge, towards minus infinity");
  return {block.x >> 2, block.y >> 2, block.z >> 2};
}
/// The coordinate of a block within its group along one axis, 0 to 3.
inline int coordinateInGroup(std::int32_t coordinate) {
  return coordinate & (kGroupEdge - 1);
}
/// The slot of a block in its group, 0 to 63, x fastest.
inline int slotInGroup(const BlockIndex& block) {
  return coordinateInGroup(block.x) +
         kGroupEdge * (coordinateInGroup(block.y) + kGroupEdge * coordinateInGroup(block.z));
}

}  // namespace bki_mapping
