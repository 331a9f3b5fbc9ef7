/// @file Which blocks lie along a segment, or around it.
#pragma once

#include "bki_mapping/core/semantic_map.h"
#include "bki_mapping/inference/index_numbering.h"

namespace bki_mapping {

/// Inserts every block with a voxel centre within `reach` of a segment, and some around those.
/// @param from, to ends of the segment in the map frame [m]. @param reach [m].
void insertBlocksAlong(const GridGeometry& geometry, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                       double reach, IndexNumbering& blocks);

/// Inserts the blocks of the map that come within `range` [m] of a point of the map frame.
void insertMappedBlocks(const SemanticMap& map, const Eigen::Vector3d& point, double range,
                        IndexNumbering& blocks);

}  // namespace bki_mapping
