/// @file The map seen from above, for navigation: where the ground is, and what is in the way.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/map/map_query.h"

namespace bki_mapping {

/// From which height obstacles are measured.
enum class HeightReference { kMap, kGround };

/// Which voxels are in the way.
struct ColumnRules {
  double min_z = -1e6;  ///< lower end of the heights looked at [m]
  double max_z = 1e6;   ///< upper end [m]
  HeightReference reference = HeightReference::kMap;
  bool operator==(const ColumnRules& o) const {
    return min_z == o.min_z && max_z == o.max_z && reference == o.reference;
  }
  bool operator!=(const ColumnRules& o) const { return !(*this == o); }
};

/// What a column of voxels, one above the other, has to say.
struct ColumnView {
  enum class Occupancy : std::int8_t { kUnknown = -1, kFree = 0, kOccupied = 100 };

  /// Top of the ground: of the lowest run of occupied voxels, one on the other, whose class is flagged
  /// ground; NaN without any [m].
  float ground = std::numeric_limits<float>::quiet_NaN();
  ClassId ground_class = kFreeClass;  ///< class of its topmost voxel
  /// From the ground to the bottom of the first occupied voxel above it that is not ignored; infinite without
  /// any, NaN without ground [m].
  float clearance = std::numeric_limits<float>::quiet_NaN();
  /// Height of all occluded voxels above the ground, added up; without ground, of all in the column [m].
  float occluded = 0.0f;
  /// Occupied if a voxel within the rules' heights is occupied by a class neither ground nor ignored; else
  /// free if there is ground, or a free voxel within the heights; else unknown. Measured from the ground,
  /// obstacles count at any height in columns without ground.
  Occupancy occupancy = Occupancy::kUnknown;
};

/// The columns of a map, kept up block by block. 64 columns, x fastest, share a column of blocks.
class ColumnMap {
 public:
  using Place = std::pair<std::int32_t, std::int32_t>;  ///< x and y of a column of blocks
  using Columns = std::array<ColumnView, kBlockEdge * kBlockEdge>;

  /// Begins anew with other rules.
  void start(const ColumnRules& rules) {
    rules_ = rules;
    blocks_.clear();
    columns_.clear();
  }
  const ColumnRules& rules() const { return rules_; }

  /// Looks again at columns with blocks that changed, were made or erased.
  /// @return the columns of blocks looked at; those without a block left are gone from columns().
  std::set<Place> update(const SemanticMap& map, const ClassTable& classes,
                         const std::vector<GridIndex>& changed);

  const std::map<Place, Columns>& columns() const { return columns_; }

 private:
  ColumnRules rules_;
  std::map<Place, std::set<std::int32_t>> blocks_;  ///< z of the blocks in each column of blocks
  std::map<Place, Columns> columns_;
};

}  // namespace bki_mapping
