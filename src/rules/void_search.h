/// @file Finds the voxels that a scan sees empty together with their neighbours: Equation 14a in
/// docs/method.md, which is not in the paper.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "bki_mapping/rules/scan_rules.h"
#include "map/blocks_by_group.h"
#include "parallel/thread_pool.h"
#include "rules/block_sums.h"

namespace bki_mapping {

/// What a scan says of the voxels of one block.
struct SeenVoxels {
  VoxelMask crossed;  ///< evidence for `free` reaches its limit, and no hit adds evidence
  VoxelMask bounds;   ///< hits add evidence, but those of what can move lie in other voxels
  VoxelMask moving;   ///< other voxels to which hits add evidence
  VoxelMask hit;      ///< contain a hit
  bool adds = false;  ///< the scan adds evidence to the block; noted if the rules keep looks
};

/// Finds void voxels: crossed or bridged, with 18 neighbours across faces and edges of which each is crossed,
/// bridged or a bound, but not near hits above empty voxels (ScanRules::thin_reach), nor near hits of what
/// can move (ScanRules::void_margin). A bridged voxel lies between two crossed ones, below and above it, and
/// no hit adds evidence to it. Keeps its memory from scan to scan.
class VoidSearch {
 public:
  /// Allocates all memory for a scan. @param blocks number of those that it touches. Set at() of each before
  /// find(). @param thin_reach, margin as in ScanRules.
  void start(std::size_t blocks, int thin_reach = 0, int margin = 0) {
    thin_reach_ = std::clamp(thin_reach, 0, ScanRules::kMostReach);
    margin_ = std::clamp(margin, 0, ScanRules::kMostReach);
    seen_.resize(blocks);
    beside_.resize(blocks);
    for (std::vector<VoxelMask>* masks : {&empty_, &open_, &along_x_, &voids_}) masks->resize(blocks);
    if (thin_reach_ > 0 || margin_ > 0) guards_.resize(blocks);
  }
  /// What the scan says of a block; until it is set, what an earlier scan said of another one. Different
  /// threads may write to different blocks.
  SeenVoxels& at(std::size_t block) { return seen_[block]; }
  /// Computes the void voxels. @param blocks all of them, sorted; their order is that of at().
  void find(const BlocksByGroup& blocks, ThreadPool& pool);
  /// The void voxels of a block, after find().
  const VoxelMask& voidsOf(std::size_t block) const { return voids_[block]; }
  /// The crossed and bridged voxels of a block, after find().
  const VoxelMask& emptyOf(std::size_t block) const { return empty_[block]; }

 private:
  /// Positions of the blocks across the faces of a block: before and after it along each axis.
  using Beside = std::array<std::array<std::uint32_t, 2>, 3>;
  /// Sets beside_. It looks up groups, not blocks, in hash tables.
  void findBlocksBeside(const BlocksByGroup& blocks, ThreadPool& pool);
  /// The voxels of a block between members along an axis. @param maskOfBlock the members, by position.
  template <typename MaskOfBlock>
  VoxelMask betweenIn(std::size_t b, std::size_t axis, const MaskOfBlock& maskOfBlock) const;
  /// Sets guards_ to the voxels that contain hits and lie above empty ones.
  void findAboveEmpty(ThreadPool& pool);
  template <typename Job>
  void forEachBlock(ThreadPool& pool, const Job& job) const;

  int thin_reach_ = 0, margin_ = 0;  ///< [voxels]
  std::vector<SeenVoxels> seen_;
  std::vector<Beside> beside_;
  std::vector<VoxelMask> empty_;    ///< crossed or bridged
  std::vector<VoxelMask> open_;     ///< these, and bounds
  std::vector<VoxelMask> along_x_;  ///< open, with both neighbours along x
  std::vector<VoxelMask> voids_;
  std::vector<VoxelMask> guards_;  ///< hits near which no voxel is void; if a rule asks for them
};

}  // namespace bki_mapping
