/// @file What a scan says, in a form that the updater can spread over blocks.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <limits>
#include <vector>

#include "beams/beam_index.h"
#include "beams/raster/group_sums.h"
#include "bki_mapping/map/semantic_map.h"
#include "parallel/index_numbering.h"
#include "parallel/thread_pool.h"
#include "points/local_point.h"
#include "update/work_limit.h"

namespace bki_mapping {

/// What one scan may add at most to one voxel.
struct EvidenceLimits {
  float hits = std::numeric_limits<float>::infinity();
  float free = std::numeric_limits<float>::infinity();
};

/// A set of classes, `free` among them.
using ClassSet = std::bitset<256>;

/// Working memory of one thread.
struct alignas(kThreadsApart) EvidenceScratch {
  EvidenceLimits limits;
  alignas(64) std::array<float, kBlockVoxels> sums{};
  alignas(64) std::array<float, kBlockVoxels> share{};  ///< of the evidence of hits that is within the limit
  std::vector<LocalPoint> points;
  std::vector<BeamRange> ranges;
  std::vector<std::uint32_t> beams;
  GroupSums group;             ///< of the group at hand
  std::size_t not_finite = 0;  ///< voxels that refused evidence (Block::add), since the update began
  /// Voxels of the block at hand that evidence for `free` leaves alone.
  std::bitset<kBlockVoxels> held;

  void leaveHeldAlone() {
    if (held.none()) return;
    for (std::size_t v = 0; v < sums.size(); ++v) sums[v] = held[v] ? 0.0f : sums[v];
  }
  /// Holds the voxels that `sums` say something of.
  void holdSums() {
    for (std::size_t v = 0; v < sums.size(); ++v) {
      if (sums[v] > 0.0f) held.set(v);
    }
  }
  /// Keeps evidence for `free` within its limit.
  void limitFree() {
    if (limits.free == std::numeric_limits<float>::infinity()) return;
    for (float& sum : sums) sum = std::min(sum, limits.free);
  }
  /// Sets `share`, by which the hits of each class are multiplied, from the sums of all classes.
  void shareHits() {
    for (std::size_t v = 0; v < sums.size(); ++v)
      share[v] = sums[v] > limits.hits ? limits.hits / sums[v] : 1.0f;
  }
  void limitHits() {
    for (std::size_t v = 0; v < sums.size(); ++v) sums[v] *= share[v];
  }
};

/// Answers two questions: which blocks do you touch, and add yourself to this block.
class Evidence {
 public:
  virtual ~Evidence() = default;

  /// The blocks to which addTo may add, each once; too many are allowed. They stay until the next call.
  /// @param map has already the blocks of the evidence that stands before this one in the update.
  /// @param most blocks, those not counted that are named because they are in the map.
  /// @throws TooMuchWork if there are more.
  virtual const std::vector<GridIndex>& collectBlocks(const SemanticMap& map, std::size_t most,
                                                      ThreadPool& pool) = 0;

  /// A number that grows with the time that a group will take: what takes long is begun first.
  virtual double effort(const BlockGroup& /*group*/) const { return 0.0; }

  /// Called before addTo of the blocks of a group, by the thread that calls these.
  /// @param group with the blocks that the update touches.
  virtual void enter(const BlockGroup& /*group*/, EvidenceScratch& /*scratch*/) const {}

  /// Fetches what addTo will read for a block.
  virtual void prefetch(std::size_t /*number*/) const {}

  /// Adds to `classes` those whose planes addTo may write to. @param number of a block.
  virtual void markClasses(std::size_t number, ClassSet& classes) const = 0;

  /// Takes all working memory that enter and addTo can need, once collectBlocks was called: a scan that runs
  /// out of memory halfway would leave a map with half a scan in it.
  virtual void reserve(EvidenceScratch& scratch) const = 0;

  /// Adds this evidence to one block. Called for each block at most once a scan, from any thread.
  /// @param number of the block in what collectBlocks gave.
  virtual void addTo(std::size_t number, const BlockIndex& index, Block& block,
                     EvidenceScratch& scratch) const = 0;
};

}  // namespace bki_mapping
