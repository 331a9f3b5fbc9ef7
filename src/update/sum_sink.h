/// @file The receiver of the sums of evidence.
#pragma once

#include <array>
#include <vector>

#include "parallel/thread_pool.h"
#include "update/block_group.h"
#include "update/update_rules.h"

namespace bki_mapping {

/// Takes the sums of the blocks of one group, applies the rules, and adds the result to the map's blocks:
/// first the hits of all blocks, then their free space. One for each thread.
class alignas(kThreadsApart) SumSink {
 public:
  /// Call before an update. @param classes most classes for a block; their memory is allocated here.
  void reserve(const UpdateRules& rules, std::size_t classes);
  /// Call before each group.
  void startGroup();
  enum class Kind { kHits, kFree };
  /// Call before each piece of evidence. @param slots of its blocks in the group. @param targets those blocks
  /// in the same order. Both must stay valid until the evidence is done.
  void startEvidence(Kind kind, const std::vector<int>& slots, const std::vector<Block*>& targets);

  /// For the evidence: returns the empty sums of its i-th block, to be filled.
  BlockSums& open(std::size_t i) {
    // Prefetch planes while the sums of the blocks before are computed.
    constexpr std::size_t kAhead = 2;
    if (i + kAhead < targets_->size()) (*targets_)[i + kAhead]->prefetch();
    current_ = i;
    sums_.clear();
    return sums_;
  }
  /// For the evidence: applies the rules to the sums, and adds them to the block.
  void close();

  /// Sums refused since reserve() because the evidence would not have stayed finite.
  std::size_t notFinite() const { return not_finite_; }

 private:
  UpdateRules rules_;
  Kind kind_ = Kind::kHits;
  const std::vector<int>* slots_ = nullptr;
  const std::vector<Block*>* targets_ = nullptr;
  std::size_t current_ = 0;
  BlockSums sums_;
  std::array<VoxelMask, kGroupBlocks> protected_;  ///< voxels that take no evidence for `free`, by slot
  std::size_t not_finite_ = 0;
};

}  // namespace bki_mapping
