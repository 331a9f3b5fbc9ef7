/// @file Frontiers found by looking at every voxel.
#pragma once

#include <functional>
#include <set>
#include <vector>

#include "bki_mapping/query/queries.h"
#include "bki_mapping/rules/voxel_state.h"

namespace bki_mapping {

/// Clusters of frontier voxels, found voxel by voxel. @param counts whether a voxel counts.
inline std::set<std::set<GridIndex>> slowFrontiers(
    const SemanticMap& map, const StateRules& rules,
    const std::function<bool(const VoxelIndex&)>& counts = [](const VoxelIndex&) { return true; }) {
  const auto stateOf = [&](int x, int y, int z) {
    return viewWithoutEntropy(map, rules, VoxelIndex{{x, y, z}}).state;
  };
  const auto unknown = [&](int x, int y, int z) {
    return stateOf(x, y, z) == VoxelState::kUnknown || stateOf(x, y, z) == VoxelState::kOccluded;
  };
  std::set<GridIndex> left;
  for (const auto& [index, block] : map.entries()) {
    for (int offset = 0; offset < kBlockVoxels; ++offset) {
      const VoxelIndex v = GridGeometry::voxelOf(index, offset);
      if (stateOf(v.x, v.y, v.z) != VoxelState::kFree || !counts(v)) continue;
      if (unknown(v.x - 1, v.y, v.z) || unknown(v.x + 1, v.y, v.z) || unknown(v.x, v.y - 1, v.z) ||
          unknown(v.x, v.y + 1, v.z) || unknown(v.x, v.y, v.z - 1) || unknown(v.x, v.y, v.z + 1)) {
        left.insert(v);
      }
    }
  }
  std::set<std::set<GridIndex>> clusters;
  while (!left.empty()) {
    std::set<GridIndex> cluster, open = {*left.begin()};
    left.erase(left.begin());
    while (!open.empty()) {
      const GridIndex from = *open.begin();
      open.erase(open.begin());
      cluster.insert(from);
      for (int n = 0; n < 27; ++n) {
        const GridIndex to = {from.x + n % 3 - 1, from.y + n / 3 % 3 - 1, from.z + n / 9 - 1};
        if (left.erase(to)) open.insert(to);
      }
    }
    clusters.insert(cluster);
  }
  return clusters;
}

inline std::set<std::set<GridIndex>> clustersOf(const std::vector<Frontier>& found) {
  std::set<std::set<GridIndex>> clusters;
  for (const Frontier& each : found) clusters.insert({each.voxels.begin(), each.voxels.end()});
  return clusters;
}

}  // namespace bki_mapping
