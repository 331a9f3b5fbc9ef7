/// @file Adds the evidence of a scan to a map.
#pragma once

#include <limits>
#include <vector>

#include "parallel/runs_by_index.h"
#include "update/evidence.h"

namespace bki_mapping {

/// What a scan says. Any of it may be missing.
struct ScanEvidence {
  Evidence* hits = nullptr;
  Evidence* free = nullptr;        ///< free space
  BlockPass* occlusion = nullptr;  ///< marks, set after the sums
};

struct MapUpdateStats {
  std::size_t blocks = 0;      ///< that the scan may have touched
  std::ptrdiff_t bytes = 0;    ///< by which the map's blocks grew
  std::size_t not_finite = 0;  ///< voxels and classes for which evidence would not have stayed finite
  double collect_ms = 0.0;     ///< listing and allocating the blocks
  double update_ms = 0.0;      ///< adding to them
};

/// What an update may take.
struct UpdateLimits {
  std::size_t blocks = std::numeric_limits<std::size_t>::max();  ///< that a piece of evidence may touch
  std::size_t bytes = std::numeric_limits<std::size_t>::max();   ///< by which the map may grow
};

/// Adds scans to maps, in three phases: collect the touched blocks and create them, reserve all memory, then
/// add, one job a group of blocks. Only the first two can fail, and they are undone if they do. Keeps its
/// memory from scan to scan.
class MapUpdater {
 public:
  /// Adds a scan: hits, then free space, then marks, as the rules say. The result does not depend on the
  /// number of threads, to the bit. Blocks about which nothing is known afterwards are not kept.
  /// @throws TooMuchWork or std::bad_alloc; the map is then as it was.
  MapUpdateStats update(SemanticMap& map, const ScanEvidence& scan, ThreadPool& pool,
                        const UpdateRules& rules = UpdateRules(),
                        const UpdateLimits& limits = UpdateLimits());

  /// The blocks that the last update may have changed, made or erased; each once.
  const std::vector<GridIndex>& touched() const { return touched_; }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// What is done to one block.
  struct Job {
    BlockIndex index;
    Block* block;
    bool is_new;
    std::size_t bytes_before;  ///< of the block; 0 if it is new
    // Once done:
    bool empty;
    std::ptrdiff_t bytes;  ///< by which the block grew
  };

  struct Group {
    BlockGroup blocks;
    std::size_t number;  ///< in group_jobs_
    double cost;
  };

  /// A piece of evidence, or a pass.
  struct Task {
    BlockTask* work;     ///< one of those that follow
    Evidence* evidence;  ///< nullptr if it is a pass
    BlockPass* pass;
    SumSink::Kind kind;  ///< of the evidence
    std::vector<std::uint32_t>
        numbers;  ///< by job: the block's index in touchedBlocks(), or kNone; the rest: none

    std::uint32_t numberOf(std::size_t job) const { return job < numbers.size() ? numbers[job] : kNone; }
  };

  /// Working memory of one thread: the blocks of a group that a task touches.
  struct alignas(kThreadsApart) Worker {
    SumSink sink;
    std::vector<GroupBlock> blocks;
    std::vector<int> slots;
    std::vector<Block*> targets;
  };

  void setTasks(const ScanEvidence& scan);
  void collectJobs(SemanticMap& map, const UpdateLimits& limits, ThreadPool& pool);
  /// @return the number of a block's job, a new one if it has none yet.
  std::uint32_t jobOf(SemanticMap& map, const BlockIndex& index);
  void groupJobs();
  /// Takes the memory of all planes and all working memory that the jobs can need.
  /// @param index_bytes by which the map's index has grown already.
  void reserve(const UpdateRules& rules, const UpdateLimits& limits, std::ptrdiff_t index_bytes,
               ThreadPool& pool);
  /// Takes the planes of a job's block. @return the classes that it can then have.
  std::size_t reservePlanes(Job& job, std::size_t number);
  /// Erases the blocks that this update made, and gives back what it took.
  void rollBack(SemanticMap& map) noexcept;
  void addGroup(const Group& group, std::size_t worker);
  /// @return the group with the blocks that a task touches, which it puts into the worker's memory.
  BlockGroup selectBlocks(const Task& task, const Group& group, Worker& to) const;

  std::vector<GridIndex> touched_;  ///< blocks, job by job
  std::vector<Job> jobs_;
  /// By position in SemanticMap::entries(): number of the block's job. What an earlier update wrote there is
  /// the number of no job now, or of another block's.
  std::vector<std::uint32_t> job_of_entry_;
  RunsByIndex<std::uint32_t> group_jobs_;  ///< jobs by group
  std::vector<Group> groups_;              ///< the most costly first
  std::vector<Task> tasks_;                ///< in the order in which they are done
  std::size_t task_count_ = 0;             ///< of this scan; tasks_ keeps the memory of more
  std::vector<Worker> workers_;
};

}  // namespace bki_mapping
