/// @file What the map says of a voxel.
#pragma once

#include <utility>
#include <vector>

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping {

/// The numbers are those of files and messages.
enum class VoxelState : std::uint8_t {
  kUnknown = 0,   ///< no evidence
  kFree = 1,      ///< `free` has more evidence, times the class's gain, than any class
  kOccupied = 2,  ///< a class has as much or more; with a gain of 1, the largest alpha
  kOccluded = 3,  ///< no evidence, and behind a hit in the last scan that reached it
};

/// The Dirichlet posterior of one voxel, summed up.
struct VoxelView {
  VoxelState state = VoxelState::kUnknown;
  ClassId label = kFreeClass;  ///< the class of an occupied voxel (ties: the smaller id), else kFreeClass
  float probability = 0.0f;    ///< p = alpha / sum(alpha) of `label`
  float variance = 0.0f;       ///< p (1 - p) / (sum(alpha) + 1)
  float entropy = 0.0f;        ///< of the expected class distribution, over all classes and `free` [nat]
  float evidence = 0.0f;       ///< sum(alpha) minus the prior's
  float occupancy = 0.0f;      ///< 1 - p(free)
};

VoxelView viewVoxel(const SemanticMap& map, const Block& block, int offset);
/// The same, but with entropy 0: most of the time goes into its logarithms.
VoxelView judgeVoxel(const SemanticMap& map, const Block& block, int offset);
/// The same for a voxel by its index; unknown where there is no block.
VoxelView judgeVoxel(const SemanticMap& map, const VoxelIndex& voxel);
/// @param point in the map frame [m].
VoxelView viewPoint(const SemanticMap& map, const Eigen::Vector3d& point);

/// The blocks sorted by index (z, then y, then x), so that output does not depend on their history.
std::vector<std::pair<BlockIndex, const Block*>> sortedBlocks(const SemanticMap& map);

/// Calls visit(const VoxelIndex&, const VoxelView&) for every voxel that is not unknown, in sorted order.
template <typename Visit>
void forEachKnownVoxel(const SemanticMap& map, Visit&& visit) {
  for (const auto& [index, block] : sortedBlocks(map)) {
    for (int offset = 0; offset < kBlockVoxels; ++offset) {
      const VoxelView view = viewVoxel(map, *block, offset);
      if (view.state != VoxelState::kUnknown) visit(GridGeometry::voxelOf(index, offset), view);
    }
  }
}

}  // namespace bki_mapping
