/// @file Evidence of a scan: which blocks it touches, and what it adds to them.
#pragma once

#include <vector>

#include "bki_mapping/map/semantic_map.h"
#include "map/block_group.h"
#include "parallel/thread_pool.h"
#include "update/sum_sink.h"
#include "update/work_limit.h"

namespace bki_mapping {

/// A step of the update that works on blocks, group by group. Owns the working memory of each thread.
class BlockTask {
 public:
  virtual ~BlockTask() = default;

  /// Lists the blocks that the task may change, each once; it may list too many. Valid until the next call.
  /// @param map already holds the blocks of the earlier tasks of the update.
  /// @param most limit of the number of blocks; blocks listed because the map holds them do not count.
  /// @throws TooMuchWork if there are more.
  virtual const std::vector<GridIndex>& touchedBlocks(const SemanticMap& map, std::size_t most,
                                                      ThreadPool& pool) = 0;

  /// Allocates all working memory that the scan can need. Called after touchedBlocks() and before the map is
  /// changed, so that a scan cannot run out of memory halfway. @param workers number of threads.
  virtual void reserve(std::size_t workers) = 0;

  /// Relative estimate of the time that a group takes, in any unit; the most costly groups start first.
  virtual double cost(const BlockGroup& /*group*/) const { return 0.0; }
};

/// The evidence of hits or of free space. It lists the blocks that it touches, and computes the sums for
/// them. MapUpdater applies the rules of the scan and adds the sums to the blocks.
class Evidence : public BlockTask {
 public:
  /// Says of which sums of a voxel only counts that they are larger; infinity: of none. Called before
  /// touchedBlocks().
  virtual void limitTo(float /*enough*/) {}

  /// Inserts the classes for which accumulate() may hand over sums. @param position of the block in
  /// touchedBlocks().
  virtual void markClasses(std::size_t position, ClassSet& classes) const = 0;

  /// Hands the sums of each block to the sink, in the order of `blocks`, in which each block comes after the
  /// one below it: rules depend on that. Called once for each group that has touched blocks, and from several
  /// threads at once for different groups.
  /// @param group the same blocks as bits. @param worker below the number given to reserve().
  virtual void accumulate(const BlockGroup& group, const std::vector<GroupBlock>& blocks, std::size_t worker,
                          SumSink& sink) = 0;
};

/// A step that sets marks on blocks after the evidence of the scan has been added to them.
class BlockPass : public BlockTask {
 public:
  /// Marks one block. Called from several threads at once, for different blocks.
  virtual void apply(const GroupBlock& block, std::size_t worker, Block& to) = 0;
};

}  // namespace bki_mapping
