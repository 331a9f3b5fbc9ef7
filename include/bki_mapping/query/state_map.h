/// @file The states of a map's voxels, kept once they have been read: what all queries work on. (How a state
/// is decided: rules/voxel_state.h.)
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "bki_mapping/rules/map_snapshot.h"
#include "bki_mapping/rules/voxel_state.h"

namespace bki_mapping {

class RegionFrontiers;
class ThreadPool;

/// Counts the owners of an object, which any of several threads may end up deleting.
class OwnerCount {
 public:
  void share() const { owners_.fetch_add(1, std::memory_order_relaxed); }
  /// @return whether nobody owns the object any more.
  bool release() const { return owners_.fetch_sub(1, std::memory_order_acq_rel) == 1; }

 private:
  mutable std::atomic<std::uint32_t> owners_{1};
};

/// States and labels of the 512 voxels of a block.
struct alignas(64) BlockStates {
  /// One bit for each voxel of a layer along z: bit x + 8 y, with x and y counted within the block.
  struct Layer {
    std::uint64_t occupied = 0, free = 0;
  };

  std::array<Layer, kBlockEdge> layers;
  std::array<std::uint64_t, kBlockEdge> occluded{};  ///< without evidence, with an occlusion mark
  std::array<ClassId, kBlockVoxels> labels;          ///< kFreeClass where not occupied
  const Block* block = nullptr;                      ///< the evidence
  bool any_occupied = false, any_free = false, all_free = false;
  bool asks_neighbourhood = false;  ///< whether states may depend on the blocks around
  OwnerCount owners;

  /// @param offset of the voxel in the block, 0 to 511.
  VoxelState state(int offset) const {
    const auto z = static_cast<std::size_t>(offset) / 64, bit = static_cast<std::size_t>(offset) % 64;
    if (layers[z].occupied >> bit & 1) return VoxelState::kOccupied;
    if (layers[z].free >> bit & 1) return VoxelState::kFree;
    return occluded[z] >> bit & 1 ? VoxelState::kOccluded : VoxelState::kUnknown;
  }
};

/// Indices from `min` to `max`, both inside.
struct GridBounds {
  GridIndex min, max;
};

/// A map prepared for queries: states and labels of each block are decided when a query first reads it, and
/// kept. Takes 0.8 kB for each block that was read, 4 kB for each region of 8 x 8 x 8 blocks, and what
/// frontiers() keeps. The StateMap of a later snapshot can take over what was decided of blocks that have not
/// changed since.
///
/// All functions, and all queries on it, may be called from several threads at once.
class StateMap {
 public:
  /// Takes microseconds. @param map which must outlive this and not change meanwhile: a snapshot.
  /// @param threads that batches of queries use, the caller's among them; 0: all cores.
  /// @throws std::invalid_argument if `threads` is negative or above 1024.
  StateMap(const SemanticMap& map, const StateRules& rules, int threads = 0);
  explicit StateMap(const MapSnapshot& snapshot, int threads = 0)
      : StateMap(snapshot.map, snapshot.rules, threads) {}
  /// The same, but shares with another StateMap what that one has decided of the blocks that both maps share.
  /// Where both maps have the same whole region, also what either of them will decide. All queries give the
  /// same answers as without. Takes some 20 ns for each shared block in regions that have changed.
  /// @param earlier which need not outlive the call; queries may be asked of it meanwhile. If its rules
  /// decide otherwise, nothing is taken over. Any other map is allowed, but pays only if it shares
  /// blocks: an earlier snapshot of the same map.
  StateMap(const SemanticMap& map, const StateRules& rules, const StateMap& earlier, int threads = 0);
  StateMap(const MapSnapshot& snapshot, const StateMap& earlier, int threads = 0)
      : StateMap(snapshot.map, snapshot.rules, earlier, threads) {}
  ~StateMap();
  StateMap(const StateMap&) = delete;
  StateMap& operator=(const StateMap&) = delete;

  const SemanticMap& map() const { return map_; }
  const StateRules& rules() const { return rules_; }
  const GridGeometry& geometry() const { return map_.geometry(); }

  /// The blocks of one region, by Region::numberOf.
  class RegionStates;

  /// @return nullptr if the map has no block in the region.
  const RegionStates* region(const GridIndex& region) const;
  /// @return nullptr if the map has no such block: all its voxels are unknown.
  const BlockStates* find(const BlockIndex& index) const;
  VoxelState state(const VoxelIndex& voxel) const;
  /// The class of an occupied voxel; kFreeClass of any other.
  ClassId label(const VoxelIndex& voxel) const;

  /// A box of whole regions that contains all blocks [blocks]; inside out if there is none.
  const GridBounds& blockBounds() const { return bounds_; }

  /// Calls job(j) for each j in [0, jobs), on the threads given to the constructor. Several callers take
  /// turns. @throws what the first failing job threw.
  void parallelFor(std::size_t jobs, const std::function<void(std::size_t)>& job) const;

  /// The frontiers of a region that were kept, or nullptr. @param position SemanticMap::positionOf.
  std::shared_ptr<const RegionFrontiers> keptFrontiers(std::uint32_t position) const {
    return std::atomic_load(&regions_[position].frontiers);
  }
  /// Keeps them, until a map has changed in the region, or in one beside it.
  void keepFrontiers(std::uint32_t position, std::shared_ptr<const RegionFrontiers> frontiers) const {
    std::atomic_store(&regions_[position].frontiers, std::move(frontiers));
  }

 private:
  /// What has been found out about a region.
  struct Known {
    Known() = default;
    ~Known();
    Known(const Known&) = delete;
    Known& operator=(const Known&) = delete;

    std::atomic<RegionStates*> states{nullptr};  ///< nullptr: not read yet
    std::shared_ptr<const RegionFrontiers> frontiers;
  };

  void takeOver(const StateMap& earlier);

  const SemanticMap& map_;
  StateRules rules_;
  int threads_;
  GridBounds bounds_{{1, 1, 1}, {0, 0, 0}};
  mutable std::vector<Known> regions_;  ///< by their positions in the map
  mutable std::mutex pool_mutex_;
  mutable std::unique_ptr<ThreadPool> pool_;  ///< made when first needed
};

class StateMap::RegionStates {
 public:
  explicit RegionStates(const Region& region) : region_(&region) {}
  /// With what was decided in another map of the blocks that did not change, nor any on which they depend.
  RegionStates(const Region& region, const SemanticMap& map, const RegionStates& earlier,
               const SemanticMap& earlier_map);
  ~RegionStates();
  RegionStates(const RegionStates&) = delete;
  RegionStates& operator=(const RegionStates&) = delete;

  /// A block, and what can be said of it without reading from its memory.
  struct Glance {
    const BlockStates* block = nullptr;  ///< nullptr if the map has no such block
    bool any_occupied = false, all_free = false;
  };

  /// @param index in this region.
  Glance glance(const StateMap& states, const BlockIndex& index) const {
    const std::uintptr_t known = slot(index).load(std::memory_order_acquire);
    return glanceOf(known != kNotRead ? known : read(states, index));
  }
  /// As StateMap::find. @param index in this region.
  const BlockStates* find(const StateMap& states, const BlockIndex& index) const {
    return glance(states, index).block;
  }
  void prefetch(const BlockIndex& index) const { __builtin_prefetch(&slot(index)); }
  /// Decides all blocks, which takes three quarters of the time that it takes one by one.
  void readAll(const StateMap& states) const;

 private:
  friend class StateMap;

  // A slot is a pointer to BlockStates with flags in the lowest bits, which the alignment leaves 0.
  static constexpr std::uintptr_t kNotRead = 0, kAnyOccupied = 1, kAllFree = 2, kAbsent = 4, kFlags = 7;
  static_assert(alignof(BlockStates) > kFlags);

  static Glance glanceOf(std::uintptr_t slot) {
    return {reinterpret_cast<const BlockStates*>(slot & ~kFlags), (slot & kAnyOccupied) != 0,
            (slot & kAllFree) != 0};
  }
  std::atomic<std::uintptr_t>& slot(const BlockIndex& index) const {
    return blocks_[static_cast<std::size_t>(Region::numberOf(index))];
  }
  /// Decides a block. Threads that do so at once get the same result; one of them keeps it. @return the slot.
  std::uintptr_t read(const StateMap& states, const BlockIndex& index) const;

  OwnerCount owners_;
  const Region* region_;  ///< exists as long as a map of which a StateMap owns this
  mutable std::array<std::atomic<std::uintptr_t>, Region::kBlocks> blocks_{};
};

/// Reads blocks one after the other; faster than StateMap::find where they lie in the same region.
class BlockReader {
 public:
  explicit BlockReader(const StateMap& states) : states_(states) {}

  /// The region of a block, or nullptr.
  const StateMap::RegionStates* region(const BlockIndex& index) {
    const GridIndex wanted = SemanticMap::regionOf(index);
    if (!is_set_ || wanted != last_) {
      region_ = states_.region(wanted);
      last_ = wanted;
      is_set_ = true;
    }
    return region_;
  }
  const BlockStates* find(const BlockIndex& index) {
    const StateMap::RegionStates* const in = region(index);
    return in ? in->find(states_, index) : nullptr;
  }

 private:
  const StateMap& states_;
  GridIndex last_;
  bool is_set_ = false;
  const StateMap::RegionStates* region_ = nullptr;
};

}  // namespace bki_mapping
