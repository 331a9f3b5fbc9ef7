/// @file What lies along rays.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "bki_mapping/core/span.h"
#include "bki_mapping/query/class_filter.h"
#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

/// A piece of a straight line.
struct Ray {
  Eigen::Vector3d origin;     ///< map frame [m]
  Eigen::Vector3d direction;  ///< axes of the map frame; of any length > 0
  double length;              ///< [m], >= 0; may be infinite: to the end of the map

  /// From one point to another, which must differ.
  static Ray between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return {from, to - from, (to - from).norm()};
  }
};

/// Where rays stop.
struct RayStops {
  ClassFilter classes =
      ClassFilter::all();  ///< at occupied voxels of these classes; others are passed through
  bool unknown = false;    ///< also at unknown and occluded voxels
};

/// Why a ray stopped.
enum class RayEnd : std::uint8_t { kNothing, kOccupied, kUnknown };

/// What a ray meets.
struct RayHit {
  RayEnd end = RayEnd::kNothing;
  ClassId label = kFreeClass;  ///< of the occupied voxel at which it stopped, else kFreeClass
  VoxelIndex voxel;            ///< at which it stopped
  /// From the origin to where it enters that voxel, or its whole length [m].
  double length = 0.0;
  /// From the origin to where it first enters an unknown or occluded voxel [m]; infinite if it does not
  /// before it stops.
  double first_unknown = std::numeric_limits<double>::infinity();
};

/// Follows a ray through all voxels of which it crosses more than a point, in order, the origin's first. A
/// voxel contains its faces on the side of the smaller coordinates: a ray within a face belongs to the voxels
/// above. A ray that starts on a face starts in the voxel that it goes on to, and one that passes through an
/// edge meets none of the voxels that it only touches there. Lengths are rounded once and do not add up, so
/// that only voxels that the ray crosses for less than some 1e-15 of its length can be missed. Blocks in
/// which the ray cannot stop are skipped: the time grows with the blocks along the ray where space is open,
/// and with the voxels near surfaces and unknown space. docs/queries.md has figures.
/// @throws std::invalid_argument if a coordinate is not finite, the direction is 0, the length is negative or
/// NaN, or the origin lies beyond the grid.
RayHit castRay(const StateMap& states, const Ray& ray, const RayStops& stops = {});

/// The same for many rays, on all threads. @param hits as long as `rays`.
/// @throws std::invalid_argument as castRay, naming the ray, or if the lengths differ; `hits` is then
/// unchanged.
void castRays(const StateMap& states, Span<const Ray> rays, const RayStops& stops, Span<RayHit> hits);

}  // namespace bki_mapping
