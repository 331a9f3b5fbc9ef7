#include "rules/near_voxels.h"

#include <array>
#include <cstdint>

namespace bki_mapping {
namespace {

/// The voxels of a block up to `reach` away along an axis from those of a mask. @param from the mask is that
/// of the block before (-1), of the same block (0), or of the block after it (1) along the axis.
LayerBits reachedFrom(int from, int axis, int reach, const LayerBits& mask) {
  constexpr std::uint64_t kWithX0 = 0x0101010101010101;
  LayerBits found = from == 0 ? mask : LayerBits{};
  for (int step = 1; step <= reach; ++step) {
    const int rest = kBlockEdge - step;
    const std::uint64_t first = kWithX0 * ((std::uint64_t{1} << step) - 1), last = first << rest;
    for (int z = 0; z < kBlockEdge; ++z) {
      const auto at = [&](int layer) {
        return layer < 0 || layer >= kBlockEdge ? 0 : mask[static_cast<std::size_t>(layer)];
      };
      const std::uint64_t own = at(z);
      std::uint64_t& to = found[static_cast<std::size_t>(z)];
      if (axis == 0) {
        to |= from < 0   ? own >> rest & first
              : from > 0 ? own << rest & last
                         : (own << step & ~first) | (own >> step & ~last);
      } else if (axis == 1) {
        to |= from < 0   ? own >> rest * kBlockEdge
              : from > 0 ? own << rest * kBlockEdge
                         : own << step * kBlockEdge | own >> step * kBlockEdge;
      } else {
        to |= from < 0 ? at(z + rest) : from > 0 ? at(z - rest) : at(z - step) | at(z + step);
      }
    }
  }
  return found;
}

/// The blocks of a group and of those around it.
class BlocksAround {
 public:
  BlocksAround(const BlocksByGroup& blocks, std::size_t group) : blocks_(blocks) {
    const GridIndex& index = blocks.groups().members()[group];
    for (int n = 0; n < 27; ++n) {
      around_[static_cast<std::size_t>(n)] =
          blocks.groups().find({index.x + n % 3 - 1, index.y + n / 3 % 3 - 1, index.z + n / 9 - 1});
    }
  }
  /// The position of a block. @param x, y, z from the first block of the group, -1 to kGroupEdge.
  std::uint32_t at(int x, int y, int z) const {
    const auto side = [](int coordinate) { return (coordinate + kGroupEdge) / kGroupEdge; };
    const std::uint32_t group = around_[static_cast<std::size_t>(side(x) + 3 * (side(y) + 3 * side(z)))];
    return group == kNoPosition ? kNoPosition : blocks_.at(group, slotInGroup({{x, y, z}}));
  }

 private:
  const BlocksByGroup& blocks_;
  std::array<std::uint32_t, 27> around_;
};

}  // namespace

void removeNear(const BlocksByGroup& blocks, const std::vector<VoxelMask>& others, int reach,
                std::vector<VoxelMask>& voxels, ThreadPool& pool) {
  const auto removeFrom = [&](const BlocksAround& around, int slot, VoxelMask& from) {
    const int x = slot % kGroupEdge, y = slot / kGroupEdge % kGroupEdge, z = slot / kSlotsOfLayer;
    for (int n = 0; n < 27; ++n) {
      const int dx = n % 3 - 1, dy = n / 3 % 3 - 1, dz = n / 9 - 1;
      const std::uint32_t other = around.at(x + dx, y + dy, z + dz);
      if (other == kNoPosition || others[other].none()) continue;
      LayerBits near = reachedFrom(dx, 0, reach, bitsOf(others[other]));
      near = reachedFrom(dy, 1, reach, near);
      from &= ~maskOf(reachedFrom(dz, 2, reach, near));
    }
  };
  pool.forEach(blocks.groups().size(), [&](std::size_t g, std::size_t) {
    const BlocksAround around(blocks, g);
    for (std::uint64_t left = blocks.slots(g); left != 0; left &= left - 1) {
      const int slot = __builtin_ctzll(left);
      VoxelMask& of_block = voxels[blocks.at(g, slot)];
      if (of_block.any()) removeFrom(around, slot, of_block);
    }
  });
}

}  // namespace bki_mapping
