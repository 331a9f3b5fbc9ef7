/// @file The points of scans that a map confirms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bki_mapping/rules/state_rules.h"
#include "bki_mapping/sequence/sequence.h"

namespace bki_mapping {

/// One point in the file, as it lies there.
struct [[gnu::packed]] CleanedPoint {
  float x, y, z;           ///< relative to the file's VIEWPOINT, map frame [m]
  float intensity;         ///< remission
  std::uint32_t label;     ///< raw label of the scan
  std::uint8_t map_class;  ///< class id of the voxel
};

struct CleanedCount {
  std::uint64_t points = 0;  ///< in the scans
  std::uint64_t kept = 0;    ///< of these in the file
  std::size_t scans = 0;     ///< that were read
};

/// Writes the points of scans that lie in occupied voxels of a map to a binary PCD file, as AtomicFile does.
/// Points are relative to the VIEWPOINT of the file: the origin of the map frame or, far from it, a place
/// near the first scan. Objects that moved away, and that the map has cleared, are not in it. Reads the scans
/// one at a time.
/// @param scans indices in the sequence. @param progress called with the number of scans done; false
/// ends the file with this scan.
/// @throws std::runtime_error if a scan cannot be read, or the file cannot be written.
CleanedCount writeCleanedPoints(const std::string& path, const Sequence& sequence,
                                const std::vector<std::size_t>& scans, const SemanticMap& map,
                                const StateRules& rules,
                                const std::function<bool(std::size_t)>& progress = nullptr);

/// @throws std::invalid_argument if the path does not end in .pcd.
void checkPointFileName(const std::string& path);

}  // namespace bki_mapping
