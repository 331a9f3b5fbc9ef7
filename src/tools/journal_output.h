/// @file The journal in the map file of a program that maps.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"
#include "journal/map_corrector.h"

namespace bki_mapping::tools {

/// What the journal of a new map file consists of.
struct JournalOutput {
  /// The map that is continued, if its journal has scans, which the new file keeps. It is locked until then.
  std::optional<MapFile> continued;
  const MapCorrector* corrector = nullptr;  ///< has the scans of the new drive; nullptr: the file has none
  std::string drive;                        ///< id of that drive

  bool empty() const { return !continued && corrector == nullptr; }
};

/// The map that is continued, if its journal has scans. @param output file that will be written.
/// @throws MapFileError.
std::optional<MapFile> withJournal(const std::string& path, const std::string& output);

/// Writes a map with a journal to a file, as NewMapFile does. @param frame of the map. @param drives in it.
/// @throws as NewMapFile.
void saveWithJournal(const std::string& path, const SemanticMapper& mapper, const std::string& frame,
                     const std::vector<DriveRecord>& drives, JournalOutput journal);

}  // namespace bki_mapping::tools
