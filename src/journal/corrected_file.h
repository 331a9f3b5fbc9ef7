/// @file Map files whose scans are moved to corrected poses, or forgotten.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Which scans of a map file are to be moved, and where.
struct CorrectionOrder {
  std::string drive;       ///< whose scans move; "": of the only drive in the journal
  double tolerance = 0.0;  ///< scans that no point of which is farther off stay [m]
  std::string output;      ///< file for the result (.bkm); "": the file itself is changed
  /// Where the scans of the drive belong, in order.
  std::function<std::vector<Eigen::Isometry3d>(const std::vector<ScanRecord>&)> wanted;
  /// Called with the number of scans that have moved, and of all that do; may be empty.
  std::function<void(std::size_t done, std::size_t all)> progress = {};
};

/// What has become of it.
struct CorrectedFile {
  std::string drive;
  std::size_t scans = 0;      ///< of the drive, in the journal
  std::size_t moved = 0;      ///< of them
  std::size_t tiles = 0;      ///< that have changed
  double largest_move = 0.0;  ///< of a point of a scan [m]
  std::string warning;        ///< a sentence on looks that stay as they were; mostly ""
};

/// Moves scans in the journal of a map file, completely or not at all: the map is then the one that these
/// poses would have made. Map and journal must fit into memory.
/// @throws std::invalid_argument if the order does not fit the file; MapFileError if a file cannot be read or
/// written, has no scans in its journal, or one of them cannot be moved; what `wanted` throws.
CorrectedFile correctMapFile(const std::string& path, const CorrectionOrder& order);

/// Scans that were dropped from a journal, and the bytes of their points.
struct ForgottenScans {
  std::uint64_t scans = 0, bytes = 0;
};

/// Drops the journal of a map file. @param output file for the result (.bkm); "": the file itself is changed,
/// and does not shrink. @throws std::invalid_argument, MapFileError.
ForgottenScans forgetJournalOfFile(const std::string& path, const std::string& output = "");

}  // namespace bki_mapping
