/// @file Compares the occupancy of a map with what the points of its scans say, where no other truth is
/// known.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/rules/state_rules.h"
#include "evaluation/occupants.h"
#include "evaluation/reliability.h"
#include "simulation/truth_cloud.h"

namespace bki_mapping {

/// Collects the voxels that scans hit or cross. By the end something is in a voxel if a point of what stands
/// is in it, and nothing if what moved there has left it, or if beams cross it and no point is in it. Nobody
/// knows of the other voxels. What no beam ever hits counts as nothing, so that this is not quite the truth:
/// TruthEvaluation is, where a drive is simulated.
class OccupancyEvaluation {
 public:
  /// @param moving raw labels of objects that move.
  OccupancyEvaluation(const GridGeometry& geometry, KittiLabels moving)
      : geometry_(geometry), moving_(std::move(moving)) {}

  /// Adds the next scan: all its finite points, and the voxels of forEachCrossedVoxel.
  void add(const Scan& scan);

  /// How often something is in a voxel, by its occupancy, over the known voxels that were hit or crossed.
  /// @param left whether what moved through a voxel has left it by the end.
  Reliability compare(const Occupants& map, const std::function<bool(const VoxelIndex&)>& left) const;
  Reliability compare(const SemanticMap& map, const StateRules& rules,
                      const std::function<bool(const VoxelIndex&)>& left) const {
    return compare(MapOccupants(map, rules), left);
  }

 private:
  struct Seen {
    VoxelIndex index;
    bool standing = false, moving = false;  ///< whether there are such points in it
  };

  Seen& seen(const VoxelIndex& index);

  GridGeometry geometry_;
  KittiLabels moving_;
  GridTable index_of_;
  std::vector<Seen> voxels_;
};

}  // namespace bki_mapping
