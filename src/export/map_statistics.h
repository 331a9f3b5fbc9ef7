/// @file What is in a map file, counted tile by tile.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/types.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

struct MapStatistics {
  std::uint64_t tiles = 0, blocks = 0, planes = 0;     ///< of the sum of all drives
  std::uint64_t free = 0, occupied = 0, occluded = 0;  ///< voxels
  std::map<ClassId, std::uint64_t> occupied_by_class;
  std::uint64_t memory_bytes = 0;  ///< of the whole map in memory, without its index
  /// From the first to the last voxel that is free, occupied or occluded. With low > high there is none.
  GridIndex low{1, 1, 1}, high{0, 0, 0};

  std::uint64_t known() const { return free + occupied; }
  /// @param bytes of the file. Infinite or NaN without known voxels.
  double bytesPerKnownVoxel(std::uint64_t bytes) const {
    return static_cast<double>(bytes) / static_cast<double>(known());
  }
  /// The space of the voxels [m]; empty without voxels.
  Eigen::AlignedBox3d bounds(double resolution) const;
};

/// The scans in the journal of a map file.
struct JournalStatistics {
  std::uint64_t scans = 0, drives = 0;
  std::uint64_t bytes = 0;  ///< of the packed scans
};
/// Reads and checks them all. @throws MapFileError.
JournalStatistics readJournalStatistics(MapFile& file);

/// Reads the map in a file, the sum of all drives, tile by tile. @param rules as storedRules. @param visit is
/// called for each block with the state of its voxels.
/// @throws MapFileError.
using BlockVisit = std::function<void(const BlockIndex& index, const BlockView& view)>;
MapStatistics readStatistics(MapFile& file, const StateRules& rules, const BlockVisit& visit = nullptr);

/// The same of a map in memory; `tiles` counts its regions.
MapStatistics statisticsOf(const SemanticMap& map, const StateRules& rules,
                           const BlockVisit& visit = nullptr);

/// What is in a map file, as JSON: one object, indented, as docs/map_file.md describes it.
/// @param drives in the order of the result. @throws MapFileError.
std::string statisticsJson(MapFile& file, const MapStatistics& found, const std::vector<DriveRecord>& drives,
                           const JournalStatistics& journal);

}  // namespace bki_mapping
