/// @file The map as seen from above, for navigation: the ground and the obstacles.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/voxel_state.h"

namespace bki_mapping {

/// From where the heights of obstacles are measured.
enum class HeightReference { kMap, kGround };

/// Which voxels count as obstacles.
struct ColumnRules {
  double min_z = -1e6;  ///< lowest height of an obstacle [m]
  double max_z = 1e6;   ///< greatest height of an obstacle [m]
  HeightReference reference = HeightReference::kMap;
  bool operator==(const ColumnRules& o) const {
    return min_z == o.min_z && max_z == o.max_z && reference == o.reference;
  }
  bool operator!=(const ColumnRules& o) const { return !(*this == o); }
};

/// Summary of one vertical column of voxels.
struct ColumnView {
  enum class Occupancy : std::int8_t { kUnknown = -1, kFree = 0, kOccupied = 100 };

  /// Top of the ground, which is the lowest uninterrupted run of occupied voxels whose class has the flag
  /// ground [m]; NaN without ground.
  float ground = std::numeric_limits<float>::quiet_NaN();
  ClassId ground_class = kFreeClass;  ///< class of the topmost voxel of the ground
  /// Distance from the ground to the bottom of the first occupied voxel above it whose class is not ignored
  /// [m]; infinite without such a voxel, NaN without ground.
  float clearance = std::numeric_limits<float>::quiet_NaN();
  /// Total height of the occluded voxels above the ground, or, without ground, in the whole column [m].
  float occluded = 0.0f;
  /// Occupied if there is an obstacle: an occupied voxel within the rules' heights, but not the one right
  /// below the ground, whose class is neither ground nor ignored. Otherwise free if there is ground or a free
  /// voxel within the heights; otherwise unknown. If heights are measured from the ground, obstacles in
  /// columns without ground count at any height.
  Occupancy occupancy = Occupancy::kUnknown;
  /// The cost of driving here, as nav_msgs/OccupancyGrid counts: if free, SemanticClass::cost of the ground's
  /// class, and 0 without ground; otherwise the value of `occupancy`.
  std::int8_t cost = static_cast<std::int8_t>(Occupancy::kUnknown);
};

/// The columns of a map, updated block by block. Columns are stored by stack, a vertical column of blocks.
class ColumnMap {
 public:
  using StackIndex = std::pair<std::int32_t, std::int32_t>;  ///< x and y of a stack [blocks]
  /// The 8 x 8 columns of voxels of a stack, x fastest.
  using Columns = std::array<ColumnView, kBlockEdge * kBlockEdge>;

  /// Forgets all columns and sets the rules.
  void start(const ColumnRules& rules) {
    rules_ = rules;
    blocks_.clear();
    columns_.clear();
  }
  const ColumnRules& rules() const { return rules_; }

  /// Recomputes the stacks that contain the given blocks, or others whose states depend on them.
  /// @param changed blocks that have changed, or were created or erased. @return those stacks; stacks without
  /// blocks are no longer in columns().
  std::set<StackIndex> update(const SemanticMap& map, const StateRules& rules, const ClassTable& classes,
                              const std::vector<GridIndex>& changed);

  /// Recomputes all stacks of a map. @return them.
  std::set<StackIndex> update(const SemanticMap& map, const StateRules& rules, const ClassTable& classes);

  const std::map<StackIndex, Columns>& columns() const { return columns_; }
  /// The column that contains a voxel; nullptr if no block is above or below it, or it.
  const ColumnView* find(const VoxelIndex& voxel) const;

 private:
  ColumnRules rules_;
  std::map<StackIndex, std::set<std::int32_t>> blocks_;  ///< z of the blocks in each stack
  std::map<StackIndex, Columns> columns_;
};

}  // namespace bki_mapping
