/// @file The mapper: scans in, a map out.
#pragma once

#include <memory>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/core/scan_refused.h"
#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/scan_stats.h"

namespace bki_mapping {

class ThreadPool;

/// Owns a map, adds scans to it, and keeps threads and working memory for that. Not for several threads at
/// once; each call may use several inside.
class SemanticMapper {
 public:
  /// @throws std::invalid_argument if a setting is not allowed, or needs an unlabelled class that the table
  /// lacks.
  SemanticMapper(const MapperConfig& config, std::shared_ptr<const ClassTable> classes);
  ~SemanticMapper();

  /// Adds one scan to the map, all of it or nothing. Bad points are left out and counted.
  /// @throws std::invalid_argument if the scan's labels are not as many as its points, or its origin is not a
  /// point that the map can hold; ScanRefused if it is larger than scan_limit/blocks, or memory does not hold
  /// it. The map is then as it was.
  ScanStats integrate(const Scan& scan);

  /// Takes over other settings; the map stays, and its states follow the gains.
  /// @throws std::invalid_argument if a setting is not allowed, or cannot change while mapping
  /// (Changes::kAtStart); the settings are then as they were.
  void reconfigure(const MapperConfig& config);

  /// Forgets all scans, and gives their memory back to the system.
  void reset();

  /// Forgets the blocks for which forget(index) is true. @return their indices.
  template <typename Forget>
  std::vector<GridIndex> eraseBlocks(Forget&& forget) {
    std::vector<GridIndex> gone;
    for (const SemanticMap::Entry& entry : map_.entries()) {
      if (!forget(entry.index)) continue;
      gone.push_back(entry.index);
      block_bytes_ -= entry.block->bytes();
    }
    for (const GridIndex& index : gone) map_.erase({index});
    return gone;
  }

  /// The blocks that the last integrate() may have changed, made or erased; each once.
  const std::vector<GridIndex>& touchedBlocks() const;
  /// Memory of the map, its index included [bytes]: map().bytes(), without a look at every block.
  std::size_t mapBytes() const { return block_bytes_ + map_.indexBytes(); }

  const SemanticMap& map() const { return map_; }
  const ClassTable& classes() const { return *classes_; }
  const MapperConfig& config() const { return config_; }

 private:
  /// What a scan goes through; holds all working memory.
  struct Pipeline;

  ScanStats add(const Scan& scan);
  /// After a failure: counts the map's bytes anew, and drops working memory, which may be large or half made.
  void recover() noexcept;
  void setGains();

  MapperConfig config_;
  std::shared_ptr<const ClassTable> classes_;
  SemanticMap map_;
  std::unique_ptr<ThreadPool> pool_;
  std::unique_ptr<Pipeline> pipeline_;  ///< none between a failure and the next scan
  std::vector<GridIndex> no_blocks_;
  std::size_t block_bytes_ = 0;  ///< of the blocks alone
};

}  // namespace bki_mapping
