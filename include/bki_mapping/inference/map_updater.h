/// @file Adds evidence to a map, block by block.
#pragma once

#include <vector>

#include "bki_mapping/inference/evidence.h"

namespace bki_mapping {

struct MapUpdateStats {
  std::size_t blocks = 0;   ///< blocks that evidence may have touched
  double collect_ms = 0.0;  ///< naming and allocating the blocks
  double update_ms = 0.0;   ///< adding to them
};

/// Adds all pieces of evidence of one scan, in the order given. The result does not depend on `threads`, to
/// the bit. Blocks about which nothing is known afterwards are not kept.
/// @param evidence at most 32 pieces.
MapUpdateStats updateMap(SemanticMap& map, const std::vector<const Evidence*>& evidence, int threads);

}  // namespace bki_mapping
