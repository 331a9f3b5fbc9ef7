/// @file What can be asked of a map: points, rays, shapes, nearest obstacles, sections and frontiers.
/// Distances at many points: distance_field.h.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/types.h"
#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

/// Arrays to be filled with the fields of VoxelView, each as long as the points; nullptr: not wanted.
struct PointValues {
  VoxelState* states = nullptr;
  ClassId* labels = nullptr;
  float* occupancy = nullptr;
  float* class_probability = nullptr;
  float* probability = nullptr;
  float* variance = nullptr;
};

/// Reads the voxels that contain the points; the values are those of viewPoint. Points beyond the grid's last
/// voxel are unknown. States and labels cost about as much as a lookup, the other fields a pass over the
/// classes of the block; sorted points are faster than scattered ones. docs/queries.md has figures.
/// @param points map frame [m].
/// @throws std::invalid_argument if a coordinate is not finite; the arrays may then be partly filled.
void readPoints(const StateMap& states, Span<const Eigen::Vector3d> points, const PointValues& values);
void readPoints(const StateMap& states, Span<const Eigen::Vector3f> points, const PointValues& values);

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
/// above. A ray that starts on a face starts in the voxel ahead, and one that passes through an
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

/// What nearestObstacle() finds.
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

/// A grid of square cells of the map's resolution. Cell (column, row) says what the voxel is at its centre.
struct Section {
  std::size_t width = 0, height = 0;  ///< columns and rows
  Eigen::Vector3d origin;             ///< corner of cell (0, 0) [m]
  Eigen::Vector3d right, up;          ///< unit vectors of rising columns and rows
  double resolution = 0.0;            ///< edge of a cell [m]
  std::vector<VoxelState> states;     ///< by row, columns fastest
  std::vector<ClassId> labels;        ///< likewise; kFreeClass where not occupied

  Eigen::Vector3d centreOf(std::size_t column, std::size_t row) const {
    return origin +
           resolution * ((static_cast<double>(column) + 0.5) * right + (static_cast<double>(row) + 0.5) * up);
  }
};

/// Sections of more cells are refused.
constexpr double kMostSectionCells = 1e8;

/// The layer of voxels at a height. Takes some 10 ns a cell.
/// @param z height [m]. @param area x and y [m]; the section has all voxels that overlap it.
/// @throws std::invalid_argument if a number is not finite, the area is inside out, or the section reaches
/// beyond the grid or is too large.
Section horizontalSection(const StateMap& states, double z, const Eigen::AlignedBox2d& area);

/// A vertical plane that stands on the line between two points, seen with `from` on the left.
/// @param from, to x and y [m]; must differ. @param min_z, max_z heights [m]; the section has all layers of
/// voxels between them. @throws std::invalid_argument likewise.
Section verticalSection(const StateMap& states, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                        double min_z, double max_z);

/// Where known free space ends, and exploration goes on: a cluster of frontier voxels. These are free, with
/// an unknown or occluded voxel on at least one of the six sides (Yamauchi, A Frontier-Based Approach for
/// Autonomous Exploration, 1997). Two that share a face, an edge or a corner belong to the same cluster.
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
/// The frontiers of the whole map, with their voxels.
std::vector<Frontier> frontiers(const StateMap& states, std::size_t min_size);
/// Finds ahead what frontiers() of the whole map keeps, in another thread than those that ask. A search
/// meanwhile shares the work: it starts with the regions that this comes to last.
/// @param goes_on asked between two regions; returns false to stop.
void prepareFrontiers(const StateMap& states, const std::function<bool()>& goes_on);

}  // namespace bki_mapping
