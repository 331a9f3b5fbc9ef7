/// @file The way of sums from the evidence into the map: SumWorkspace, of a thread; GroupInWork, of a group
/// of blocks; SumSink, of a piece of evidence. Each needs the one before.
#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "map/block_group.h"
#include "parallel/thread_pool.h"
#include "rules/apply_scan_rules.h"
#include "update/sum_kernels.h"

namespace bki_mapping {

/// A block of a group that a piece of evidence, or a pass, touches.
class GroupBlock {
 public:
  BlockIndex index;
  std::uint32_t position;  ///< in BlockTask::touchedBlocks()

  /// @param seen, seam what the scan says of the block, to be noted if rules ask for it; nullptr: they do
  /// not.
  GroupBlock(const BlockIndex& index_of_block, std::uint32_t position_of_block, Block* block,
             SeenVoxels* seen, BlockSeam* seam)
      : index(index_of_block),
        position(position_of_block),
        block_(block),
        seen_(seen),
        seam_(seam),
        slot_(static_cast<std::size_t>(slotInGroup(index))) {}

 private:
  friend class MapUpdater;
  friend class SumSink;  // evidence itself writes to no map

  Block* block_;
  SeenVoxels* seen_;
  BlockSeam* seam_;
  std::size_t slot_;
};

/// Working memory of one thread, for one scan after the other.
class alignas(kThreadsApart) SumWorkspace {
 public:
  /// @param classes most classes for a block; their memory is allocated here.
  void reserve(const ScanRules& rules, std::size_t classes, bool withdraws) {
    rules_ = rules;
    withdraws_ = withdraws;
    counts_ = {};
    sums_.reserve(classes);
  }
  const SumCounts& counts() const { return counts_; }  ///< since reserve()

 private:
  friend class GroupInWork;
  friend class SumSink;

  const SumKernels* kernels_ = &sumKernelsFor("");
  const LimitKernels* limits_ = &limitKernelsFor("");
  ScanRules rules_;
  bool withdraws_ = false;
  BlockSums sums_;
  std::array<VoxelMask, kGroupBlocks> protected_;        ///< voxels that take no evidence for `free`, by slot
  std::array<VoxelMask, kGroupBlocks> hit_;              ///< voxels to which hits add evidence, by slot
  std::array<std::uint64_t, kGroupBlocks> reached_top_;  ///< as in BlockSeam, by slot
  SumCounts counts_;
};

/// The group that a thread works on: remembers what its hits say, for its free space. One lives at a time.
class GroupInWork {
 public:
  explicit GroupInWork(SumWorkspace& workspace) : workspace_(workspace) {
    if (workspace.rules_.hits_before_misses) workspace.protected_.fill({});
    if (workspace.rules_.seeksVoids()) workspace.hit_.fill({});
    if (workspace.rules_.asksBelow()) workspace.reached_top_.fill(0);
  }

 private:
  friend class SumSink;
  SumWorkspace& workspace_;
};

/// Receives the sums of the blocks of one group from one piece of evidence, hits before free space: applies
/// the rules, rounds the result to units, and adds it to the map's blocks, or subtracts it.
class SumSink {
 public:
  enum class Kind { kHits, kFree };

  /// @param blocks must stay as they are while this exists.
  SumSink(GroupInWork& group, Kind kind, const std::vector<GroupBlock>& blocks)
      : work_(group.workspace_), kind_(kind), blocks_(blocks) {
    for (std::size_t i = 0; i < std::min(kAhead, blocks.size()); ++i) blocks[i].block_->prefetch();
  }

  /// The voxels of the i-th block that take no evidence from what is added now.
  VoxelMask protectedOf(std::size_t i) const {
    if (kind_ == Kind::kHits || !work_.rules_.hits_before_misses) return {};
    return work_.protected_[blocks_[i].slot_];
  }

  /// Adds to the i-th block what `fill(BlockSums&)` puts into its empty sums. Call it by rising i.
  template <typename Fill>
  void add(std::size_t i, Fill&& fill) {
    if (i + kAhead < blocks_.size()) blocks_[i + kAhead].block_->prefetch();
    work_.sums_.clear();
    std::forward<Fill>(fill)(work_.sums_);
    addSums(blocks_[i]);
  }

 private:
  /// So many blocks ahead, planes are prefetched while the sums of the blocks before are computed.
  static constexpr std::size_t kAhead = 2;

  void addSums(const GroupBlock& to);
  /// Also fills the seam of the block, and reached_top_. @return the voxels whose evidence for `free` reaches
  /// its limit.
  VoxelMask applyRulesToFree(const GroupBlock& block);

  SumWorkspace& work_;
  Kind kind_;
  const std::vector<GroupBlock>& blocks_;
};

}  // namespace bki_mapping
