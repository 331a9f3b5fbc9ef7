/// @file The obstacle nearest to a point.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include "bki_mapping/core/span.h"
#include "bki_mapping/query/class_filter.h"
#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

struct NearestObstacle {
  VoxelIndex voxel;
  ClassId label;
  double distance;  ///< from the point to the voxel's centre [m]
};

/// The occupied voxel of one of the classes whose centre is nearest to a point; of several, the first in the
/// order of GridIndex. Exact. The time grows with the blocks within the distance of what it finds: for many
/// points of one region, a DistanceField is faster.
/// @param point map frame [m]. @param max_distance to the centre [m], >= 0; may be infinite.
/// @return nothing if there is none within max_distance.
/// @throws std::invalid_argument if a coordinate is not finite or beyond the grid, or max_distance is
/// negative or NaN.
std::optional<NearestObstacle> nearestObstacle(const StateMap& states, const Eigen::Vector3d& point,
                                               const ClassFilter& classes = ClassFilter::all(),
                                               double max_distance = std::numeric_limits<double>::infinity());

/// The same for many points, on all threads. @param found as long as `points`.
/// @throws std::invalid_argument as nearestObstacle, naming the point, or if the lengths differ; `found` is
/// then unchanged.
void nearestObstacles(const StateMap& states, Span<const Eigen::Vector3d> points, const ClassFilter& classes,
                      double max_distance, Span<std::optional<NearestObstacle>> found);

}  // namespace bki_mapping
