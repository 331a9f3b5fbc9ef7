/// @file The journal of a map file: scans of a MapCorrector as rows, and back.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "journal/map_corrector.h"
#include "journal/scan_journal.h"

namespace bki_mapping {

/// What a row says of a scan that the scan in memory does not know.
struct StoredAs {
  std::uint64_t number = 0;  ///< in the file
  std::string drive, sensor;
  int settings = 0;       ///< number in the file
  int first_cleared = 0;  ///< number in the file of the first box that the journal in memory knows
  bool jump = false;
};

/// The row of a scan where it is in the map now.
ScanRecord recordOf(const JournalScan& scan, const StoredAs& stored);

/// Gives a corrector that has no scans those of a file's journal, with the jumps of their poses and the
/// boxes that were cleared, and notes as foreign where the map in the file has other evidence: from scans
/// that the journal lacks. @return what the corrector does not know of the scans, in the order of its
/// journal.
/// @throws MapFileError, also if a scan refers to settings that cannot be used; std::bad_alloc. The corrector
/// then has some of the scans; reset() it.
std::vector<StoredAs> restoreJournal(MapFile& file, MapCorrector& corrector);

/// The bounding box of the blocks that a map has in some tiles, map frame [m]; empty if there are none.
Eigen::AlignedBox3d boundsIn(const SemanticMap& map, const std::vector<GridIndex>& tiles);

}  // namespace bki_mapping
