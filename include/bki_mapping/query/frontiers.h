/// @file Frontiers: where known free space ends, and exploration goes on.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

/// A cluster of frontier voxels: free ones with an unknown or occluded voxel on at least one of the six sides
/// (Yamauchi, A Frontier-Based Approach for Autonomous Exploration, 1997). Two voxels that share a face, an
/// edge or a corner belong to the same cluster.
struct Frontier {
  Eigen::Vector3d centre;          ///< mean of the centres of its voxels [m]
  std::size_t size;                ///< number of its voxels
  std::vector<VoxelIndex> voxels;  ///< in the order of GridIndex; empty unless FrontierRules::with_voxels
};

/// Which frontiers to look for.
struct FrontierRules {
  std::size_t min_size = 1;  ///< least number of voxels; smaller frontiers are left out
  bool with_voxels = true;   ///< whether to list the voxels, which takes some 5 ns for each
  /// Map frame [m]: only frontier voxels that it overlaps count, as if there were no others. A voxel beyond
  /// it still decides whether one inside is a frontier voxel. Without: the whole map.
  std::optional<Eigen::AlignedBox3d> box;
};

/// The frontiers of a map, the largest first; of equal size, by the first voxel. The first search takes some
/// 0.5 us for each block in the box. It keeps what it finds in each region that the box contains, 5 kB.
/// Without lists of voxels, further searches take a tenth of that or less; with them, about as long as the
/// first.
/// @throws std::invalid_argument if the box is not finite, inside out, or reaches beyond the grid.
std::vector<Frontier> frontiers(const StateMap& states, const FrontierRules& rules = {});
/// Finds ahead what frontiers() of the whole map keeps, in another thread than those that ask. A search
/// meanwhile shares the work: it starts with the regions that this comes to last.
/// @param goes_on asked between two regions; returns false to stop.
void prepareFrontiers(const StateMap& states, const std::function<bool()>& goes_on);
/// Those of the whole map, with their voxels.
std::vector<Frontier> frontiers(const StateMap& states, std::size_t min_size);

}  // namespace bki_mapping
