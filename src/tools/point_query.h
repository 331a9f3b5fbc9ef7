/// @file What a city or a map file says at points, which come as text: "X Y Z" on a command line, or a file.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/city/tiled_map.h"
#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/query/queries.h"

namespace bki_mapping::tools {

/// Three finite numbers, separated by commas or spaces. @return nothing if the text is anything else.
std::optional<Eigen::Vector3d> parsePoint(std::string text);

/// Appends the points of a file, one a line; "-": of standard input. Empty lines, lines that begin with #,
/// and a first line of names are left out. @throws std::invalid_argument if the file cannot be read, a line
/// is not a point, or `points` would have more than ten million.
void readPointFile(const std::string& path, std::vector<Eigen::Vector3d>& points);

/// Asks a map at points. They are sorted by the tile that holds them, so that the points of a tile are
/// answered from one reading.
class PointQuery {
 public:
  /// @param points in the map frame [m]. They and the map are kept by reference.
  /// @param memory_limit of the tiles that are in memory at once [bytes]; 0: no limit.
  PointQuery(TiledMap& map, const std::vector<Eigen::Vector3d>& points, std::size_t memory_limit);

  /// Reads what the voxels of the points are. @throws as TiledMap.
  void readAll();
  /// Finds the obstacle nearest to each point. @param most the largest distance at which an obstacle counts
  /// [m]. @param classes of obstacles. @throws as TiledMap.
  void findNearest(double most, const ClassFilter& classes);
  /// Writes CSV: a line of names, and a line for each point, in the order in which they were given.
  void print(std::ostream& out, const ClassTable& classes, bool with_nearest) const;

 private:
  /// The answers for one point.
  struct Answer {
    VoxelState state = VoxelState::kUnknown;
    ClassId label = kFreeClass;
    float occupancy = 0.0f, class_probability = 0.0f, probability = 0.0f, variance = 0.0f;
    std::optional<NearestObstacle> nearest;
  };
  /// Stands for the tiles of points beyond the grid.
  static constexpr GridIndex kNoTile{std::numeric_limits<std::int32_t>::max(), 0, 0};

  /// Calls visit(numbers) with the numbers of the points of `tiles` tiles at a time; of the last ones,
  /// perhaps of fewer.
  template <typename Visit>
  void forEachGroup(std::size_t tiles, Visit&& visit);

  TiledMap& map_;
  GridGeometry grid_;
  const std::vector<Eigen::Vector3d>& points_;
  std::vector<Answer> answers_;                            ///< of the points, in their order
  std::vector<std::pair<GridIndex, std::size_t>> sorted_;  ///< tile and number of each point
  std::size_t limit_;
};

}  // namespace bki_mapping::tools
