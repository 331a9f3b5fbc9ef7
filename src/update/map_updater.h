/// @file Adds evidence to a map, block by block.
#pragma once

#include <limits>
#include <vector>

#include "parallel/runs_by_index.h"
#include "update/evidence.h"

namespace bki_mapping {

struct MapUpdateStats {
  std::size_t blocks = 0;      ///< blocks that evidence may have touched
  std::ptrdiff_t bytes = 0;    ///< by which the map's blocks grew
  std::size_t not_finite = 0;  ///< voxels and classes for which it would not have stayed a finite number
  double collect_ms = 0.0;     ///< naming and allocating the blocks
  double update_ms = 0.0;      ///< adding to them
};

/// What an update may take.
struct UpdateLimits {
  EvidenceLimits evidence;
  std::size_t blocks = std::numeric_limits<std::size_t>::max();  ///< that a piece of evidence may touch
  std::size_t bytes = std::numeric_limits<std::size_t>::max();   ///< by which the map may grow
};

/// Adds evidence to maps. Keeps its memory from scan to scan.
class MapUpdater {
 public:
  /// Adds all pieces of evidence of one scan, in the order given. The result does not depend on the number of
  /// workers, to the bit. Blocks about which nothing is known afterwards are not kept.
  /// @throws TooMuchWork or std::bad_alloc; the map is then as it was. All memory is taken before anything is
  /// added.
  MapUpdateStats update(SemanticMap& map, const std::vector<Evidence*>& evidence, ThreadPool& pool,
                        const UpdateLimits& limits = UpdateLimits());

  /// The blocks that the last update may have changed, made or erased; each once.
  const std::vector<GridIndex>& touched() const { return touched_; }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

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
    BlockGroup group;
    std::size_t number;  ///< in group_jobs_
    double effort;
  };

  void collectJobs(SemanticMap& map, const std::vector<Evidence*>& evidence, const UpdateLimits& limits,
                   ThreadPool& pool);
  /// Takes the memory of all planes and all working memory that the jobs can need.
  /// @param index_bytes by which the map's index grew already.
  void reserve(const std::vector<Evidence*>& evidence, const UpdateLimits& limits, std::ptrdiff_t index_bytes,
               ThreadPool& pool);
  /// Takes the planes of a job's block. @return by how many bytes it grew.
  std::size_t reservePlanes(const std::vector<Evidence*>& evidence, std::size_t number);
  /// Erases the blocks that this update made, and gives back what it took.
  void rollBack(SemanticMap& map) noexcept;
  /// @return the number of a block's job, a new one if it has none yet.
  std::uint32_t jobOf(SemanticMap& map, const BlockIndex& index);
  void groupJobs(const std::vector<Evidence*>& evidence);
  /// @return the number of a job's block in a piece of evidence, or kNone.
  std::uint32_t numberIn(std::size_t evidence, std::size_t job) const;
  /// Fetches what work will read and write for a job.
  void prefetch(const std::vector<Evidence*>& evidence, std::size_t number) const;
  void work(const std::vector<Evidence*>& evidence, const Group& group, EvidenceScratch& scratch);
  void work(const std::vector<Evidence*>& evidence, std::size_t number, EvidenceScratch& scratch);

  std::vector<GridIndex> touched_;  ///< blocks, job by job
  std::vector<Job> jobs_;
  RunsByIndex<std::uint32_t> group_jobs_;  ///< jobs by group
  std::vector<Group> groups_;              ///< what takes long first
  /// Of each piece of evidence, by job: the block's number there, or kNone; none behind its end.
  std::vector<std::vector<std::uint32_t>> number_of_;
  std::vector<EvidenceScratch> scratch_;  ///< one a worker
};

}  // namespace bki_mapping
