/// @file The journals of merged maps.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "store/drives.h"

namespace bki_mapping {

/// A map file some drives of which are in a merged map.
struct JournalSource {
  MapFile* file;
  DriveSet drives;       ///< their ids
  std::string obstacle;  ///< why the merged map cannot have their scans; "": it can
};

/// Copies the scans of drives to the journal of a merged map, which is empty. The result does not depend on
/// the order of the sources. Of a drive that several files have, it takes the scans of that with the most.
/// Boxes that were cleared may be in one file only: scans of the others would be missing in them.
/// @return a sentence for each file with scans that the merged map does not have, in the order of the paths.
std::vector<std::string> mergeJournals(const std::vector<JournalSource>& sources, MapFile::Change& merged);

}  // namespace bki_mapping
