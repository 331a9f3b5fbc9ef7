/// @file The mapper: builds a map from scans.
#pragma once

#include <memory>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/scan_stats.h"
#include "bki_mapping/rules/map_snapshot.h"

namespace bki_mapping {

class ThreadPool;

/// Owns a map and adds scans to it. Keeps its threads and working memory between scans. Not thread-safe; a
/// call may use several threads itself.
class SemanticMapper {
 public:
  /// @throws std::invalid_argument if a setting is not allowed, or requires an unlabelled class that the
  /// table lacks.
  SemanticMapper(const MapperConfig& config, std::shared_ptr<const ClassTable> classes);
  ~SemanticMapper();

  /// Adds one scan to the map, either all of it or nothing. Bad points are skipped and counted.
  /// @throws std::invalid_argument if the numbers of labels and points differ, or the origin has no valid
  /// index. @throws ScanRefused if the scan exceeds scan_limit/blocks or memory. The map is then unchanged.
  ScanStats integrate(const ScanView& scan);

  /// Withdraws a scan that was integrated with the current settings. Looks stay (rules/latest); otherwise
  /// the map is then the same, to the bit, as
  /// if the scan had never been integrated, regardless of later scans; voxels whose evidence had saturated
  /// are an exception (ScanStats::saturated). Withdrawing a scan that is not in the map leaves negative
  /// evidence, which counts as 0 (ScanStats::negative). @throws as integrate(), and std::logic_error with
  /// free_space/extent `mapped` or occlusion marks, which depend on the order of scans.
  ScanStats withdraw(const ScanView& scan);

  /// Adds another map, for example from a file. The map is then the same, to the bit, as if the scans of both
  /// had been integrated here.
  /// @throws std::invalid_argument as SemanticMap::add, std::bad_alloc; the map is then unchanged.
  void addMap(const SemanticMap& other);
  /// The same, but takes from the other map what it can instead of copying it. What the other map holds
  /// afterwards is not specified; if this throws, both maps are unchanged.
  void addMap(SemanticMap&& other);

  /// Moves a region of the map to a map of its own (SemanticMap::takeRegion).
  SemanticMap takeRegion(const GridIndex& region);

  /// Moves the whole map out; this one is empty afterwards.
  SemanticMap takeMap();

  /// Replaces what scans saw of the blocks of a region (bki_mapping::replaceLooks). @return the blocks that
  /// changed.
  std::vector<GridIndex> replaceLooks(const GridIndex& region, const LooksByBlock& looks);

  /// Clears a box of the map (bki_mapping::clearBox). @return the blocks that changed.
  std::vector<GridIndex> clearBox(const Eigen::AlignedBox3d& box);

  /// Replaces the settings. The map stays; the states of its voxels follow the new rules.
  /// @throws std::invalid_argument if a setting is not allowed, or differs but can change only at the start
  /// (Changes::kAtStart); the settings are then unchanged.
  void reconfigure(const MapperConfig& config);

  /// Clears the map, and returns its memory to the system.
  void reset();

  /// Erases the blocks for which forget(index) is true. @return their indices.
  template <typename Forget>
  std::vector<GridIndex> eraseBlocks(Forget&& forget) {
    std::vector<GridIndex> erased;
    for (const auto& [index, block] : map_.entries()) {
      if (forget(index)) erased.push_back(index);
    }
    for (const GridIndex& index : erased) {
      const std::size_t bytes = map_.find({index})->bytes();
      map_.erase({index});
      block_bytes_ -= bytes;
    }
    return erased;
  }

  /// The map as it is now with the rules that say what its voxels are, for other threads to read
  /// (SemanticMap::snapshot).
  MapSnapshot snapshot() { return {map_.snapshot(), state_rules_}; }

  /// The blocks that the last integrate() or withdraw() may have changed, created or erased, each once.
  const std::vector<GridIndex>& touchedBlocks() const;
  /// Memory of the map and its index [bytes]. Equals map().bytes(), but does not visit every block.
  std::size_t mapBytes() const { return block_bytes_ + map_.indexBytes(); }

  const SemanticMap& map() const { return map_; }
  /// What decides the states of the map's voxels.
  const StateRules& rules() const { return state_rules_; }
  const ClassTable& classes() const { return *classes_; }
  const std::shared_ptr<const ClassTable>& sharedClasses() const { return classes_; }
  const MapperConfig& config() const { return config_; }

 private:
  /// The stages that a scan passes; holds all working memory.
  struct Pipeline;
  Pipeline& pipeline();

  ScanStats addOrWithdraw(const ScanView& scan, bool withdraws);
  ScanStats add(const ScanView& scan, bool withdraws);
  /// Cleans up after a failure: recounts the map's bytes, and frees the working memory, which may be large.
  void recover() noexcept;
  void countBlockBytes() noexcept;
  /// Adds a map, and counts the memory that it takes.
  template <typename Map>
  void addCounting(Map&& other);

  MapperConfig config_;
  std::shared_ptr<const ClassTable> classes_;
  SemanticMap map_;
  StateRules state_rules_;
  std::unique_ptr<ThreadPool> pool_;
  std::unique_ptr<Pipeline> pipeline_;  ///< nullptr between a failure and the next scan
  std::vector<GridIndex> no_blocks_;
  std::size_t block_bytes_ = 0;  ///< memory of the blocks, without the index
};

}  // namespace bki_mapping
