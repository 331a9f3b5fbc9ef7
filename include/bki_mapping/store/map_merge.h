/// @file Merges map files.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/store/map_info.h"

namespace bki_mapping {

/// Where a map lies in the frame of another: it is turned about the z axis of its frame, then moved.
struct MapPlacement {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< [m]
  double yaw = 0.0;                                       ///< counter-clockwise, seen from above [degrees]
};

struct MergeInput {
  std::string path;
  /// In the frame of the result; without it, the map is in that frame already.
  std::optional<MapPlacement> placement;
};

struct MergeOptions {
  std::vector<MergeInput> inputs;
  std::string output;        ///< may be one of the inputs
  bool keep_drives = false;  ///< stores the evidence of each drive apart as well, as far as the inputs do
  std::vector<std::string> without;  ///< ids of drives to be left out
  /// Is told how many tiles are done.
  std::function<void(std::size_t done, std::size_t all)> progress;
};

struct MergeReport {
  std::vector<DriveRecord> drives;    ///< of the result, sorted by id
  std::vector<std::string> repeated;  ///< ids of the drives that more than one input has, sorted
  std::vector<std::string>
      resampled;  ///< inputs that were not moved by whole voxels and turned by 90 degrees
  std::uint64_t tiles = 0, blocks = 0;  ///< of the result, parts not counted
  /// Sums that stopped at the end of their range (kMostUnits), over voxels and classes.
  std::uint64_t saturated = 0;
};

/// Merges maps: the result is the sum of the drives that are in any of them, each counted once. It does not
/// depend on the order of the inputs, and is written by NewMapFile. Holds one tile of each file, or those
/// tiles from which one is resampled, and the lists of tiles, but never a map.
///
/// Placements by whole voxels and multiples of 90 degrees are exact. With others, each voxel takes the
/// evidence of the voxel in which its centre lies, so that some evidence is doubled or lost.
/// @throws MapFileError if a file cannot be read or written, or if a drive is in two inputs and cannot be
/// counted once, differs between them, or cannot be left out; std::invalid_argument if grids, classes or
/// frames differ, a placement is not finite or moves blocks beyond GridGeometry::kMaxCoordinate, or a drive
/// to be left out is in no input.
MergeReport mergeMaps(const MergeOptions& options);

}  // namespace bki_mapping
