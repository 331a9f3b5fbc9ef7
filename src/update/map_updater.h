/// @file Adds the evidence of a scan to a map.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "map/blocks_by_group.h"
#include "rules/void_search.h"
#include "update/evidence.h"
#include "update/sum_kernels.h"

namespace bki_mapping {

/// The evidence of one scan; any part may be nullptr.
struct ScanEvidence {
  Evidence* hits = nullptr;
  Evidence* free = nullptr;        ///< of free space
  BlockPass* occlusion = nullptr;  ///< sets its marks after the sums are added
  bool withdraws = false;          ///< subtracts the evidence instead of adding it
  std::uint64_t stamp = 0;         ///< time of the scan [ns]; 0: not known, so that no looks are kept
};

struct MapUpdateStats {
  std::size_t blocks = 0;    ///< that the scan may have touched
  std::ptrdiff_t bytes = 0;  ///< growth of the memory of the map's blocks
  SumCounts sums;
  double collect_ms = 0.0;  ///< listing and allocating the blocks
  double update_ms = 0.0;   ///< adding to them
};

/// Limits of one update.
struct UpdateLimits {
  std::size_t blocks = std::numeric_limits<std::size_t>::max();  ///< that hits, or free space, may touch
  std::size_t bytes = std::numeric_limits<std::size_t>::max();   ///< by which the map's memory may grow
};

/// Adds scans to maps in four phases:
/// 1. collect the touched blocks, create those that are missing, and order them by group;
/// 2. reserve all memory, and copy the blocks that a snapshot shares;
/// 3. add the sums, one job for each group;
/// 4. mend what depends on blocks of other groups: the threshold across the seams of groups, and voids.
/// Only the first two phases can fail; they are then undone. Keeps its memory from scan to scan.
class MapUpdater {
 public:
  /// Adds a scan: hits, then free space, then marks. The result is the same to the bit for any number of
  /// threads. Blocks that are empty afterwards are erased.
  /// @throws TooMuchWork or std::bad_alloc; the map is then unchanged.
  MapUpdateStats update(SemanticMap& map, const ScanEvidence& scan, ThreadPool& pool,
                        const ScanRules& rules = ScanRules(), const UpdateLimits& limits = UpdateLimits());

  /// The blocks that the last update may have changed, created or erased, each once.
  const std::vector<GridIndex>& touched() const { return touched_; }

 private:
  /// A touched block of the map.
  struct BlockJob {
    BlockIndex index;
    Block* block;
    std::shared_ptr<Block> copy;  ///< to be written to instead of a block that a snapshot shares
    std::uint32_t number;         ///< position in touched()
    bool is_new, is_shared;
    std::size_t bytes_before;  ///< memory of the block; 0 if it is new
    // Set after adding:
    bool empty;
    std::ptrdiff_t bytes;  ///< growth of the block's memory
  };

  struct Group {
    BlockGroup blocks;
    std::size_t position;  ///< in by_group_.groups()
    double cost;
  };

  /// One step of the update: evidence or a pass.
  struct Task {
    BlockTask* work;     ///< `evidence` or `pass`
    Evidence* evidence;  ///< nullptr for a pass
    BlockPass* pass;     ///< valid if `evidence` is nullptr
    SumSink::Kind kind;  ///< of the evidence
    /// By the number of a job: the block's position in touchedBlocks() or kNoPosition. Later jobs have
    /// kNoPosition.
    std::vector<std::uint32_t> positions;

    std::uint32_t positionOf(std::size_t job) const {
      return job < positions.size() ? positions[job] : kNoPosition;
    }
  };

  /// Working memory of one thread.
  struct alignas(kThreadsApart) Worker {
    SumWorkspace sums;
    std::vector<GroupBlock> blocks;  ///< of a group that a task touches
    SumCounts mended;                ///< of mend()
  };

  void setTasks(const ScanEvidence& scan);
  // The phases:
  void collect(SemanticMap& map, const UpdateLimits& limits, ThreadPool& pool);
  /// @param index_bytes growth of the map's index in this update.
  void reserve(const UpdateLimits& limits, std::ptrdiff_t index_bytes, ThreadPool& pool);
  void add(ThreadPool& pool);
  void mend(ThreadPool& pool);

  /// Calls visit(job, worker) for each job, in parallel, by its position. @param prefetch called as
  /// prefetch(job) some jobs before, when the block itself, without planes and looks, is near the core.
  template <typename Prefetch, typename Visit>
  void forEachJob(ThreadPool& pool, const Prefetch& prefetch, const Visit& visit);

  // Parts of collect():
  /// @return the position of a block's job in jobs_; creates the job, and the block, if missing.
  std::uint32_t jobOf(SemanticMap& map, const BlockIndex& index);
  void groupJobs(ThreadPool& pool);
  // Of reserve():
  /// Reserves the planes of a job's block.
  /// @return the number of classes to which this scan may add in the block.
  std::size_t reservePlanes(BlockJob& job);
  /// Reserves the planes of all blocks. @return the most classes that one of them needs.
  std::size_t reserveBlocks(const UpdateLimits& limits, std::ptrdiff_t index_bytes, ThreadPool& pool);
  void reserveSeams();
  /// Puts the copies of shared blocks into the map.
  void useCopies(SemanticMap& map) noexcept;
  /// Undoes the first two phases: erases the blocks that they created, and frees reserved planes.
  void rollBack(SemanticMap& map) noexcept;
  // Of add():
  void addGroup(const Group& group, std::size_t worker);
  /// Lists, in the worker's memory, the blocks of a group that a task touches. @return them as a group.
  BlockGroup selectBlocks(const Task& task, const Group& group, Worker& to);
  // Of mend():
  /// Adds to the bottom layer of a group what the threshold has taken above crossed voxels, or withdraws it.
  void mendSeams(const Group& group, std::size_t worker);
  /// Adds evidence for `free` to the void voxels of a job's block, or takes it back. @param units of
  /// evidence, 64 times.
  void addVoids(std::size_t job, const EvidenceUnits* units, std::size_t worker);
  /// Notes what the scan saw of the voxels of a job's block, if it adds evidence there. @param voids_add
  /// whether it does so in void voxels.
  void addLooks(std::size_t job, bool voids_add) noexcept;

  bool mends() const { return rules_.seeksVoids() || rules_.asksBelow(); }
  /// Counts the memory of a job's block, and returns that of planes that are gone.
  void finish(BlockJob& job);

  const SumKernels& kernels_ = sumKernelsFor("");
  std::vector<GridIndex> touched_;  ///< blocks, in the order in which jobs were collected
  std::vector<BlockJob> jobs_;      ///< as collected, then in the order of by_group_
  std::vector<BlockJob> sorted_;    ///< memory for sorting them
  BlocksByGroup by_group_;
  std::vector<Group> groups_;   ///< by falling cost
  std::vector<Task> tasks_;     ///< in the order of execution
  std::size_t task_count_ = 0;  ///< tasks of this scan; tasks_ may be longer to keep memory
  std::vector<Worker> workers_;
  // Of this scan:
  ScanRules rules_;
  bool withdraws_ = false;
  bool keeps_looks_ = false;
  std::uint64_t tick_ = 0;
  VoidSearch voids_;
  std::vector<BlockSeam> seams_;                                       ///< of the jobs
  std::vector<std::array<float, kBlockEdge * kBlockEdge>> seam_sums_;  ///< of those at the bottom of a group
};

}  // namespace bki_mapping
