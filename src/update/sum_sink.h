/// @file The receiver of the sums of evidence.
#pragma once

#include <array>
#include <vector>

#include "parallel/thread_pool.h"
#include "update/block_group.h"
#include "update/sum_kernels.h"
#include "update/update_rules.h"

namespace bki_mapping {

/// Receives the sums of the blocks of one group, applies the rules, rounds the result to units, and adds it
/// to the map's blocks, or subtracts it: first the hits of all blocks, then their free space. Each thread has
/// one.
class alignas(kThreadsApart) SumSink {
 public:
  /// Call before an update. @param classes most classes for a block; their memory is allocated here.
  void reserve(const UpdateRules& rules, std::size_t classes, bool withdraws);
  /// Call before each group.
  void startGroup();
  enum class Kind { kHits, kFree };
  /// Call before each piece of evidence. @param slots of its blocks in the group, rising. @param targets
  /// those blocks in the same order. @param seen, seams what the scan says of those blocks, to be noted if
  /// rules ask for it. All must stay valid until the evidence is done.
  void startEvidence(Kind kind, const std::vector<int>& slots, const std::vector<Block*>& targets,
                     const std::vector<SeenVoxels*>& seen, const std::vector<BlockSeam*>& seams);

  /// For the evidence: returns the empty sums of its i-th block, to be filled.
  BlockSums& open(std::size_t i) {
    // Prefetch planes while the sums of the blocks before are computed.
    constexpr std::size_t kAhead = 2;
    if (i + 2 * kAhead < targets_->size()) __builtin_prefetch((*targets_)[i + 2 * kAhead]);
    if (i + kAhead < targets_->size()) (*targets_)[i + kAhead]->prefetch();
    current_ = i;
    sums_.clear();
    return sums_;
  }
  /// For the evidence: applies the rules to the sums, and adds them to the block.
  void close();

  const SumCounts& counts() const { return counts_; }  ///< since reserve()

 private:
  /// Also fills the seam of the block, and reached_top_. @return the voxels whose evidence for `free` reaches
  /// its limit.
  VoxelMask applyRulesToFree(std::size_t slot);

  const SumKernels* kernels_ = &sumKernelsFor("");
  UpdateRules rules_;
  bool withdraws_ = false;
  Kind kind_ = Kind::kHits;
  const std::vector<int>* slots_ = nullptr;
  const std::vector<Block*>* targets_ = nullptr;
  const std::vector<SeenVoxels*>* seen_ = nullptr;
  const std::vector<BlockSeam*>* seams_ = nullptr;
  std::size_t current_ = 0;
  BlockSums sums_;
  std::array<VoxelMask, kGroupBlocks> protected_;        ///< voxels that take no evidence for `free`, by slot
  std::array<VoxelMask, kGroupBlocks> hit_;              ///< voxels to which hits add evidence, by slot
  std::array<std::uint64_t, kGroupBlocks> reached_top_;  ///< as in BlockSeam, by slot
  SumCounts counts_;
};

}  // namespace bki_mapping
