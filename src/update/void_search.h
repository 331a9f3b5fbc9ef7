/// @file Finds the voxels that a scan sees empty together with all their neighbours.
#pragma once

#include <vector>

#include "parallel/index_numbering.h"
#include "parallel/thread_pool.h"
#include "update/block_sums.h"

namespace bki_mapping {

/// What a scan says of the voxels of one block.
struct SeenVoxels {
  VoxelMask crossed;  ///< evidence for `free` reaches the limit, and no hit adds evidence
  VoxelMask fixed;    ///< hits add evidence, all of them of classes that cannot move
};

/// Finds void voxels: crossed, with 26 neighbours of which each is crossed or fixed. Keeps its memory from
/// scan to scan.
class VoidSearch {
 public:
  /// Forgets the last scan, and takes all memory for this one. @param blocks number of those that it touches.
  void start(std::size_t blocks) {
    seen_.assign(blocks, {});
    masks_.resize(blocks);
    before_.resize(blocks);
  }
  /// What the scan says of a block; different threads may write to different blocks.
  SeenVoxels& at(std::size_t block) { return seen_[block]; }
  /// Computes the void voxels. @param blocks with positions as in at().
  void find(const IndexNumbering& blocks, ThreadPool& pool);
  /// The void voxels of a block, after find().
  const VoxelMask& voidsOf(std::size_t block) const { return masks_[block]; }

 private:
  std::vector<SeenVoxels> seen_;
  std::vector<VoxelMask> masks_, before_;
};

}  // namespace bki_mapping
