/// @file What is in a map file, as JSON for programs.
#pragma once

#include <string>
#include <vector>

#include "export/map_statistics.h"

namespace bki_mapping {

/// One object, indented, as docs/map_file.md describes it. @param drives in the order of the result.
/// @throws MapFileError.
std::string statisticsJson(MapFile& file, const MapStatistics& found, const std::vector<DriveRecord>& drives,
                           const JournalStatistics& journal);

}  // namespace bki_mapping
