/// @file What a scan says of the map: which blocks it touches, and what it adds there.
#pragma once

#include <bitset>
#include <vector>

#include "bki_mapping/map/semantic_map.h"
#include "parallel/thread_pool.h"
#include "update/block_group.h"
#include "update/sum_sink.h"
#include "update/work_limit.h"

namespace bki_mapping {

/// A set of classes, `free` among them.
using ClassSet = std::bitset<256>;

/// A block of a group, and its index in touchedBlocks().
struct GroupBlock {
  BlockIndex index;
  std::uint32_t number;
};

/// Something that a scan does to blocks, group by group. Owns the working memory of each thread.
class BlockTask {
 public:
  virtual ~BlockTask() = default;

  /// The blocks that the task may change, each once; too many are allowed. They stay until the next call.
  /// @param map already has the blocks of the tasks that come earlier in the update.
  /// @param most blocks, not counting those that are listed because they are in the map.
  /// @throws TooMuchWork if there are more.
  virtual const std::vector<GridIndex>& touchedBlocks(const SemanticMap& map, std::size_t most,
                                                      ThreadPool& pool) = 0;

  /// Takes all working memory that the scan can need, once touchedBlocks() was called: a scan that runs out
  /// of memory halfway would leave half of itself in the map. @param workers threads that will work at once.
  virtual void reserve(std::size_t workers) = 0;

  /// Grows with the time that a group will take, in any unit: costly groups start first.
  virtual double cost(const BlockGroup& /*group*/) const { return 0.0; }
};

/// Hits, or free space. Answers two questions: which blocks do you touch, and what do you add there? It
/// writes to no block and knows no rule: MapUpdater applies the rules and adds.
class Evidence : public BlockTask {
 public:
  /// Adds to `classes` those to which accumulate() may add. @param number of a block in touchedBlocks().
  virtual void markClasses(std::size_t number, ClassSet& classes) const = 0;

  /// Hands the sums of each of these blocks to the sink, in their order. Called once for each group with
  /// touched blocks; from several threads at once, for different groups.
  /// @param group with the bits of `blocks`. @param worker below the count given to reserve().
  virtual void accumulate(const BlockGroup& group, const std::vector<GroupBlock>& blocks, std::size_t worker,
                          SumSink& sink) = 0;
};

/// Marks on blocks that are not sums, made once the evidence of the scan has been added to the block.
class BlockPass : public BlockTask {
 public:
  /// Marks one block. Called from several threads at once, for different blocks.
  virtual void apply(const GroupBlock& block, std::size_t worker, Block& to) = 0;
};

}  // namespace bki_mapping
