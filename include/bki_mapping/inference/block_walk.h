/// @file Which blocks lie along a segment, or around it.
#pragma once

#include <vector>

#include "bki_mapping/core/semantic_map.h"
#include "bki_mapping/inference/index_numbering.h"

namespace bki_mapping {

/// A straight piece of a beam, in the map frame [m].
struct Segment {
  Eigen::Vector3d from, to;
};

/// Inserts every block with a voxel centre within `reach` [m] of a segment, and some around those.
void insertBlocksAlong(const GridGeometry& geometry, const std::vector<Segment>& segments, double reach,
                       IndexNumbering& blocks);

/// Inserts the blocks of the map that come within `range` [m] of a point of the map frame.
void insertMappedBlocks(const SemanticMap& map, const Eigen::Vector3d& point, double range,
                        IndexNumbering& blocks);

}  // namespace bki_mapping
