/// @file What a map shows in each voxel, for measures that take maps of any kind.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/rules/voxel_state.h"

namespace bki_mapping {

/// What a map says of one voxel.
struct Occupant {
  VoxelState state = VoxelState::kUnknown;
  ClassId label = kFreeClass;       ///< class of an occupied voxel; kFreeClass in a map without classes
  std::optional<double> occupancy;  ///< probability that something is there, where the map has evidence
};

/// What a map shows in its voxels at one moment.
class Occupants {
 public:
  using Visit = std::function<void(const VoxelIndex&, const Occupant&)>;

  virtual ~Occupants() = default;
  /// The class of an occupied voxel; nullopt if the voxel is not occupied. A map without classes gives
  /// kFreeClass.
  virtual std::optional<ClassId> at(const VoxelIndex& voxel) = 0;
  virtual Occupant occupantOf(const VoxelIndex& voxel) const = 0;
  /// Visits every voxel that is not unknown, once.
  virtual void forEachKnown(const Visit& visit) const = 0;
};

/// The same of a semantic map, which must not change meanwhile. at() reads each block once.
class MapOccupants : public Occupants {
 public:
  /// @param map, rules must outlive this.
  MapOccupants(const SemanticMap& map, const StateRules& rules) : map_(map), rules_(rules) {}
  std::optional<ClassId> at(const VoxelIndex& voxel) override;
  Occupant occupantOf(const VoxelIndex& voxel) const override;
  void forEachKnown(const Visit& visit) const override;

 private:
  const SemanticMap& map_;
  const StateRules& rules_;
  GridTable view_of_;
  std::vector<BlockView> views_;
};

}  // namespace bki_mapping
