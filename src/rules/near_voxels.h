/// @file Finds voxels near others.
#pragma once

#include <vector>

#include "map/blocks_by_group.h"
#include "map/voxel_mask.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// Removes from the voxels of blocks those that lie up to `reach` away, along each axis, from one of others.
/// Allocates nothing. @param blocks sorted; their order is that of the masks. @param reach less than
/// kBlockEdge [voxels].
void removeNear(const BlocksByGroup& blocks, const std::vector<VoxelMask>& others, int reach,
                std::vector<VoxelMask>& voxels, ThreadPool& pool);

}  // namespace bki_mapping
