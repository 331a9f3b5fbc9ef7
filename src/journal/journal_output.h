/// @file The journal in the map file of a program that maps.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"
#include "journal/kept_scans.h"

namespace bki_mapping {

/// What the journal of a new map file consists of.
struct JournalOutput {
  /// The map that is continued, if its journal has scans, which the new file keeps. It is locked until then.
  std::optional<MapFile> continued;
  /// The scans of the new drive, after finish(); nullptr: the file has none of them.
  const KeptScans* kept = nullptr;
  std::string drive;  ///< id of that drive

  bool empty() const { return !continued && kept == nullptr; }
};

/// The map that is continued, if its journal has scans. @param output file that will be written.
/// @throws MapFileError.
std::optional<MapFile> withJournal(const std::string& path, const std::string& output);

/// Writes a map with a journal to a file, as NewMapFile does. @param frame of the map. @param drives in it.
/// @throws as NewMapFile.
void saveWithJournal(const std::string& path, const SemanticMapper& mapper, const std::string& frame,
                     const std::vector<DriveRecord>& drives, JournalOutput journal);

}  // namespace bki_mapping
