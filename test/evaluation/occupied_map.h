#pragma once

#include <vector>

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping {

/// A map with voxels of 1 m, in which those of the given points are occupied.
inline SemanticMap mapOf(const std::vector<Eigen::Vector3d>& occupied) {
  SemanticMap map(GridGeometry(1.0), 0.001, 4);
  for (const Eigen::Vector3d& point : occupied) {
    EvidenceUnits plane[kBlockVoxels] = {};
    const VoxelIndex voxel = map.geometry().voxelAt(point);
    plane[GridGeometry::offsetInBlock(voxel)] = unitsOf(1.0);
    map.getOrAllocate(GridGeometry::blockOf(voxel)).add(1, plane);
  }
  return map;
}

}  // namespace bki_mapping
