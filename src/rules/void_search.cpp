#include "rules/void_search.h"

#include <algorithm>
#include <cstdint>

#include "parallel/chunks.h"
#include "rules/near_voxels.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kLast = kBlockEdge - 1;
constexpr std::uint64_t kColumn = 0x0101010101010101;  ///< the voxels of a layer with x = 0
constexpr std::uint64_t kRow = 0xff;                   ///< those with y = 0
constexpr int kAcrossX = kBlockEdge - 1, kAcrossY = kBlockEdge * (kBlockEdge - 1);

/// The voxels whose two neighbours along the axis are members. @param previous, mask, next the members in a
/// block, and in the two beside it.
LayerBits between(std::size_t axis, const LayerBits& previous, const LayerBits& mask, const LayerBits& next) {
  LayerBits found;
  for (std::size_t z = 0; z <= kLast; ++z) {
    std::uint64_t below = z == 0 ? previous[kLast] : mask[z - 1], above = z == kLast ? next[0] : mask[z + 1];
    if (axis == 0) {
      below = (mask[z] & ~(kColumn << kAcrossX)) << 1 | (previous[z] >> kAcrossX & kColumn);
      above = (mask[z] & ~kColumn) >> 1 | (next[z] & kColumn) << kAcrossX;
    } else if (axis == 1) {
      below = mask[z] << kBlockEdge | (previous[z] >> kAcrossY & kRow);
      above = mask[z] >> kBlockEdge | (next[z] & kRow) << kAcrossY;
    }
    found[z] = below & above;
  }
  return found;
}

/// From slot to slot of a group along each axis.
constexpr int kStride[3] = {1, kGroupEdge, kSlotsOfLayer};

GridIndex neighbour(GridIndex group, std::size_t axis, int step) {
  (axis == 0 ? group.x : axis == 1 ? group.y : group.z) += step;
  return group;
}

}  // namespace

void VoidSearch::findBlocksBeside(const BlocksByGroup& blocks, ThreadPool& pool) {
  pool.forEach(blocks.groups().size(), [&](std::size_t g, std::size_t) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        const std::uint32_t next = blocks.groups().find(neighbour(blocks.groups().members()[g], axis, step));
        for (std::uint64_t left = blocks.slots(g); left != 0; left &= left - 1) {
          const int slot = __builtin_ctzll(left), at = slot / kStride[axis] % kGroupEdge + step;
          const bool same = at >= 0 && at < kGroupEdge;
          const int there = slot + (same ? step : -step * (kGroupEdge - 1)) * kStride[axis];
          const std::size_t group = same ? g : next;
          beside_[blocks.at(g, slot)][axis][step > 0] =
              group == kNoPosition ? kNoPosition : blocks.at(group, there);
        }
      }
    }
  });
}

template <typename MaskOfBlock>
VoxelMask VoidSearch::betweenIn(std::size_t b, std::size_t axis, const MaskOfBlock& maskOfBlock) const {
  const auto bits = [&](std::uint32_t position) {
    return position == kNoPosition ? LayerBits{} : bitsOf(maskOfBlock(position));
  };
  const auto [previous, next] = beside_[b][axis];
  return maskOf(between(axis, bits(previous), bitsOf(maskOfBlock(b)), bits(next)));
}

template <typename Job>
void VoidSearch::forEachBlock(ThreadPool& pool, const Job& job) const {
  const Chunks chunks(seen_.size());
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) job(b);
  });
}

void VoidSearch::findAboveEmpty(ThreadPool& pool) {
  forEachBlock(pool, [&](std::size_t b) {
    guards_[b] = seen_[b].hit;
    if (guards_[b].none()) return;
    const std::uint32_t below = beside_[b][2][0];
    const LayerBits empty = bitsOf(empty_[b]);
    LayerBits above_empty = {below == kNoPosition ? 0 : bitsOf(empty_[below])[kLast]};
    std::copy(empty.begin(), empty.end() - 1, above_empty.begin() + 1);
    guards_[b] &= maskOf(above_empty);
  });
}

void VoidSearch::find(const BlocksByGroup& blocks, ThreadPool& pool) {
  findBlocksBeside(blocks, pool);
  forEachBlock(pool, [&](std::size_t b) {
    const SeenVoxels& seen = seen_[b];
    empty_[b] = seen.crossed;
    if (seen.crossed.any() && !seen.crossed.all()) {
      empty_[b] |= betweenIn(b, 2, [&](std::size_t n) -> const VoxelMask& { return seen_[n].crossed; }) &
                   ~(seen.bounds | seen.moving);
    }
    open_[b] = empty_[b] | seen.bounds;
  });
  const auto open = [&](std::size_t n) -> const VoxelMask& { return open_[n]; };
  forEachBlock(pool, [&](std::size_t b) {
    along_x_[b] = open(b);
    if (along_x_[b].any()) along_x_[b] &= betweenIn(b, 0, open);
  });
  // With both neighbours across the faces, those across an edge are two steps away, along different axes.
  forEachBlock(pool, [&](std::size_t b) {
    const auto along_x = [&](std::size_t n) -> const VoxelMask& { return along_x_[n]; };
    const auto along_y = [&](std::size_t n) { return open(n) & betweenIn(n, 1, open); };
    VoxelMask& voids = voids_[b];
    // Cheapest first: far from the sensor, beams are sheets, and voxels above or below them are not seen.
    voids = empty_[b] & along_x_[b];
    if (voids.any()) voids &= betweenIn(b, 2, along_x);
    if (voids.any()) voids &= betweenIn(b, 1, along_x);
    if (voids.any()) voids &= along_y(b) & betweenIn(b, 2, along_y);
  });
  if (thin_reach_ > 0) {
    findAboveEmpty(pool);
    removeNear(blocks, guards_, thin_reach_, voids_, pool);
  }
  if (margin_ > 0) {
    forEachBlock(pool, [&](std::size_t b) { guards_[b] = seen_[b].moving; });
    removeNear(blocks, guards_, margin_, voids_, pool);
  }
}

}  // namespace bki_mapping
