/// @file Clears a box of a map.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping {

/// Erases all evidence and occlusion marks of the voxels whose centres lie in a box or on its faces. They are
/// then unknown, as if no scan had reached them. Planes and blocks that become empty are erased.
/// @param box map frame [m]; may be infinite. @return the blocks that changed or were erased, sorted.
/// @throws std::bad_alloc; part of the box may then be cleared.
std::vector<GridIndex> clearBox(SemanticMap& map, const Eigen::AlignedBox3d& box);

}  // namespace bki_mapping
