/// @file Adds evidence to a map, block by block.
#pragma once

#include <vector>

#include "bki_mapping/inference/evidence.h"

namespace bki_mapping {

struct MapUpdateStats {
  std::size_t blocks = 0;    ///< blocks that evidence may have touched
  std::ptrdiff_t bytes = 0;  ///< by which the map's blocks grew
  double collect_ms = 0.0;   ///< naming and allocating the blocks
  double update_ms = 0.0;    ///< adding to them
};

/// Adds evidence to maps. Keeps its memory from scan to scan.
class MapUpdater {
 public:
  void setLimits(const EvidenceLimits& limits) { limits_ = limits; }

  /// Adds all pieces of evidence of one scan, in the order given. The result does not depend on the number of
  /// workers, to the bit. Blocks about which nothing is known afterwards are not kept.
  /// @param evidence at most 32 pieces.
  MapUpdateStats update(SemanticMap& map, const std::vector<Evidence*>& evidence, Workers& workers);

  /// The blocks that the last update may have changed, made or erased; each once.
  const std::vector<GridIndex>& touched() const { return numbering_.members(); }

 private:
  struct Job {
    BlockIndex index;
    Block* block;
    std::uint32_t pieces;  ///< bit e: evidence e touches the block
    std::size_t bytes;     ///< of the block before the update; 0 for new ones
  };

  void collectJobs(SemanticMap& map, const std::vector<Evidence*>& evidence, Workers& workers);

  EvidenceLimits limits_;
  IndexNumbering touched_, numbering_;
  std::vector<Job> jobs_;
  std::vector<EvidenceScratch> scratch_;  ///< one a worker
};

}  // namespace bki_mapping
