#include "update/void_search.h"

#include <array>

#include "parallel/chunks.h"

namespace bki_mapping {
namespace {

/// The two faces of a block along an axis.
struct Faces {
  std::size_t stride;  ///< from voxel to voxel along the axis, as in GridGeometry::offsetInBlock
  VoxelMask first, last;
};

Faces facesAlong(std::size_t axis) {
  Faces faces = {axis == 0   ? std::size_t{1}
                 : axis == 1 ? std::size_t{kBlockEdge}
                             : kBlockEdge * kBlockEdge,
                 {},
                 {}};
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    faces.first[v] = v / faces.stride % kBlockEdge == 0;
    faces.last[v] = v / faces.stride % kBlockEdge == kBlockEdge - 1;
  }
  return faces;
}

/// The voxels of `mask` whose two neighbours along the axis are members, too.
VoxelMask erode(const VoxelMask& previous, const VoxelMask& mask, const VoxelMask& next, const Faces& faces) {
  const std::size_t across = (kBlockEdge - 1) * faces.stride;
  const VoxelMask below = (mask & ~faces.last) << faces.stride | (previous & faces.last) >> across;
  const VoxelMask above = (mask & ~faces.first) >> faces.stride | (next & faces.first) << across;
  return mask & below & above;
}

GridIndex neighbour(GridIndex block, std::size_t axis, int step) {
  (axis == 0 ? block.x : axis == 1 ? block.y : block.z) += step;
  return block;
}

}  // namespace

void VoidSearch::find(const IndexNumbering& blocks, ThreadPool& pool) {
  static const std::array<Faces, 3> kFaces = {facesAlong(0), facesAlong(1), facesAlong(2)};
  const VoxelMask none;
  for (std::size_t b = 0; b < seen_.size(); ++b) masks_[b] = seen_[b].crossed | seen_[b].fixed;
  const Chunks chunks(seen_.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::swap(before_, masks_);
    pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
      for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
        masks_[b] = before_[b];
        if (before_[b].none()) continue;
        const auto beside = [&](int step) -> const VoxelMask& {
          const std::uint32_t position = blocks.find(neighbour(blocks.members()[b], axis, step));
          return position == kNoPosition ? none : before_[position];
        };
        masks_[b] = erode(beside(-1), before_[b], beside(1), kFaces[axis]);
      }
    });
  }
  for (std::size_t b = 0; b < seen_.size(); ++b) masks_[b] &= seen_[b].crossed;
}

}  // namespace bki_mapping
