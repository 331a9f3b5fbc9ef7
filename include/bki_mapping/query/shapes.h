/// @file What is in boxes and spheres: is the space free, is it known, which classes are in it?
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "bki_mapping/core/span.h"
#include "bki_mapping/query/class_filter.h"
#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

struct Sphere {
  Eigen::Vector3d centre;  ///< map frame [m]
  double radius;           ///< [m], > 0
};

/// A box of any orientation.
struct OrientedBox {
  Eigen::Isometry3d T_map_box;   ///< pose of its centre in the map frame [m]
  Eigen::Vector3d half_extents;  ///< along its own axes [m], > 0
};

/// The voxels that a shape overlaps, by state. (A shape that only touches a voxel does not overlap it.)
struct SpaceContent {
  std::size_t free = 0, occupied = 0;
  std::size_t unknown = 0;  ///< without evidence; occluded ones are among them
  ClassFilter classes;      ///< of the occupied voxels

  bool isFree() const { return occupied == 0 && unknown == 0; }
  bool isKnown() const { return unknown == 0; }
  /// The first of the classes in `order`, the worst first, that is present.
  std::optional<ClassId> worst(Span<const ClassId> order) const;
};

/// Shapes that overlap more voxels are refused; so are boxes about such shapes.
constexpr double kMostShapeVoxels = 1e8;

/// What a shape overlaps. Takes a few nanoseconds for each row of up to eight voxels along x.
/// @throws std::invalid_argument if the shape is not finite, inside out or empty, reaches beyond the grid, or
/// is too large. A box may be flat: of zero extent it overlaps the voxels that contain it.
SpaceContent contentOf(const StateMap& states, const Eigen::AlignedBox3d& box);
SpaceContent contentOf(const StateMap& states, const Sphere& sphere);
SpaceContent contentOf(const StateMap& states, const OrientedBox& box);

/// The same for many shapes, on all threads. @param contents as long as the shapes.
/// @throws std::invalid_argument as contentOf, naming the shape, or if the lengths differ.
void contentsOf(const StateMap& states, Span<const Eigen::AlignedBox3d> boxes, Span<SpaceContent> contents);
void contentsOf(const StateMap& states, Span<const Sphere> spheres, Span<SpaceContent> contents);

/// The content of a vehicle's box at each pose of a path, on all threads. What the vehicle sweeps between two
/// poses is not looked at: give poses not farther apart than a voxel or two.
/// @param box pose and size in the vehicle's frame. @param T_map_vehicle the poses, without scale or shear.
/// @param contents as long as the poses. @throws std::invalid_argument as contentOf, naming the pose, or if
/// the lengths differ.
void contentsAlong(const StateMap& states, const OrientedBox& box,
                   Span<const Eigen::Isometry3d> T_map_vehicle, Span<SpaceContent> contents);

}  // namespace bki_mapping
