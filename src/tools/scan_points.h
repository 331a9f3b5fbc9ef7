/// @file The points of the scans in the journal of a map file.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping::tools {

struct ScanPointCount {
  std::uint64_t scans = 0, points = 0;
};

/// Writes the hits of all scans in the journal of a file, where the scans are in the map, to a binary .ply or
/// .pcd file, as AtomicFile does. docs/files.md describes the fields. Reads the scans one at a time.
/// @param box only hits in it, its faces included, map frame [m]. @param progress is called with the number
/// of scans done, and of all. @throws std::invalid_argument on another extension; MapFileError if the file
/// has no scans, or is damaged; std::runtime_error if the file cannot be written.
ScanPointCount writeScanPoints(const std::string& path, MapFile& file, const Eigen::AlignedBox3d& box,
                               const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace bki_mapping::tools
