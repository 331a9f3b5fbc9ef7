/// @file Merges map files.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Where a map lies in the frame of another: it is turned about the z axis of its frame, then moved.
struct MapPlacement {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< [m]
  double yaw = 0.0;                                       ///< counter-clockwise, seen from above [degrees]
};

struct MergeInput {
  std::string path;
  /// Where the map lies in the frame of the result. Without a placement, its frame is the result's frame.
  std::optional<MapPlacement> placement;
};

/// Columns of tiles, of every height: indices x and y from `low` to `high`, both included.
struct TileColumns {
  std::int32_t low_x = 0, low_y = 0, high_x = 0, high_y = 0;

  bool contain(const GridIndex& tile) const {
    return tile.x >= low_x && tile.x <= high_x && tile.y >= low_y && tile.y <= high_y;
  }
};

struct MergeOptions {
  std::vector<MergeInput> inputs;
  std::string output;                ///< may be one of the inputs
  bool keep_drives = false;          ///< also stores each drive separately, as far as the inputs allow
  std::vector<std::string> without;  ///< ids of the drives to leave out
  /// Also adds drives that share scans by their ids, such as 04/000000-000009 and 04/000000-000004.
  bool allow_overlap = false;
  /// Only these tiles of the result; all of them without a value. The result lists all drives even so.
  std::optional<TileColumns> columns;
  /// Called with the number of tiles done, and of all.
  std::function<void(std::size_t done, std::size_t all)> progress;
};

struct MergeReport {
  std::vector<DriveRecord> drives;     ///< of the result, sorted by id
  std::vector<std::string> repeated;   ///< ids of the drives that more than one input contains, sorted
  std::vector<std::string> resampled;  ///< paths of the inputs whose placement is not exact
  /// A sentence for each input with scans in its journal that the result does not have.
  std::vector<std::string> without_journal;
  std::uint64_t tiles = 0, blocks = 0;  ///< in part 0 of the result
  /// Number of sums of a voxel and class that were cut at the greatest evidence (kMostUnits).
  std::uint64_t saturated = 0;
};

/// Merges maps: the result is the sum of all drives in the inputs, each counted once. It does not depend on
/// the order of the inputs. It is written as NewMapFile does. The memory needed is that of the lists of tiles
/// and of one tile for each file (where a map is resampled, of the tiles that one tile is made from).
///
/// The journal of the result has the scans of its drives, where inputs have them, with two exceptions: if
/// drives are kept apart, inputs are moved or only some tiles are written, and if boxes were cleared in
/// several inputs.
///
/// Placements by whole voxels and multiples of 90 degrees are exact. With others, each voxel takes the
/// evidence of the voxel that contains its centre, so that some evidence is doubled or lost.
/// @throws MapFileError if a file cannot be read or written, or if a drive differs between two inputs, cannot
/// be counted once, or cannot be left out, or if drives of different inputs share scans by their ids;
/// std::invalid_argument if grids, classes or frames differ, a
/// placement is not finite or moves blocks beyond GridGeometry::kMaxCoordinate, or no input contains a drive
/// that is to be left out.
MergeReport mergeMaps(const MergeOptions& options);

}  // namespace bki_mapping
