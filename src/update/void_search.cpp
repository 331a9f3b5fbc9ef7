#include "update/void_search.h"

#include <cstdint>

#include "parallel/chunks.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kLast = kBlockEdge - 1;
constexpr std::uint64_t kColumn = 0x0101010101010101;  ///< the voxels of a layer with x = 0
constexpr std::uint64_t kRow = 0xff;                   ///< those with y = 0
constexpr int kAcrossX = kBlockEdge - 1, kAcrossY = kBlockEdge * (kBlockEdge - 1);

/// The voxels of `mask` whose two neighbours along the axis are members, too. @param previous, next the
/// members in the two blocks beside it.
LayerBits erode(std::size_t axis, const LayerBits& previous, const LayerBits& mask, const LayerBits& next) {
  LayerBits eroded;
  for (std::size_t z = 0; z <= kLast; ++z) {
    std::uint64_t below = z == 0 ? previous[kLast] : mask[z - 1], above = z == kLast ? next[0] : mask[z + 1];
    if (axis == 0) {
      below = (mask[z] & ~(kColumn << kAcrossX)) << 1 | (previous[z] >> kAcrossX & kColumn);
      above = (mask[z] & ~kColumn) >> 1 | (next[z] & kColumn) << kAcrossX;
    } else if (axis == 1) {
      below = mask[z] << kBlockEdge | (previous[z] >> kAcrossY & kRow);
      above = mask[z] >> kBlockEdge | (next[z] & kRow) << kAcrossY;
    }
    eroded[z] = mask[z] & below & above;
  }
  return eroded;
}

GridIndex neighbour(GridIndex block, std::size_t axis, int step) {
  (axis == 0 ? block.x : axis == 1 ? block.y : block.z) += step;
  return block;
}

}  // namespace

void VoidSearch::find(const IndexNumbering& blocks, ThreadPool& pool) {
  const Chunks chunks(seen_.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::swap(before_, masks_);
    const auto before = [&](std::size_t b) {
      return axis > 0 ? before_[b] : seen_[b].crossed | seen_[b].fixed;
    };
    pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
      for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
        masks_[b] = before(b);
        if (masks_[b].none()) continue;
        const auto beside = [&](int step) -> LayerBits {
          const std::uint32_t position = blocks.find(neighbour(blocks.members()[b], axis, step));
          return position == kNoPosition ? LayerBits{} : bitsOf(before(position));
        };
        masks_[b] = maskOf(erode(axis, beside(-1), bitsOf(masks_[b]), beside(1)));
        if (axis == 2) masks_[b] &= seen_[b].crossed;
      }
    });
  }
}

}  // namespace bki_mapping
