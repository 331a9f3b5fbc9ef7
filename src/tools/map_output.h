/// @file The file for the map of programs that map: its options, and how it is written. For programs that
/// link `export`.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/export/map_export.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/atomic_file.h"
#include "journal/journal_output.h"
#include "tools/options.h"

namespace bki_mapping::tools {

/// Adds --output and --include.
inline void addMapOutput(po::options_description& options) {
  options.add_options()("output", textOption("FILE.bkm|FILE.ply|FILE.pcd"),
                        "file for the map: .bkm holds all of it, .ply or .pcd its voxels as points")(
      "include", textOption("STATES")->default_value("occupied"),
      "voxels in a .ply or .pcd file: occupied,free,occluded");
}

/// Adds --journal, of programs that write a map file.
inline void addJournal(po::options_description& options) {
  options.add_options()("journal", realOption("--journal", 1e-4, 1.0)->value_name("METRES"),
                        "keep the scans in the map file, where correct_map can move them; their points are "
                        "rounded to multiples of this in the sensor's frame, as with the parameter journal "
                        "of a node");
}

/// Checks both before long work. @throws std::invalid_argument, or as checkWritable().
inline void checkMapOutput(const po::variables_map& given) {
  parseStates(given["include"].as<std::string>());
  if (given.count("output") == 0) return;
  checkMapName(given["output"].as<std::string>());
  checkWritable(given["output"].as<std::string>());
}

/// Whether a map file (.bkm) will be written.
inline bool writesMapFile(const po::variables_map& given) {
  return given.count("output") > 0 && isMapFileName(given["output"].as<std::string>());
}

/// Writes the map to the file of --output, if one is given. @param frame of the map. @param drives in it.
/// @param journal for a map file.
inline void writeMap(const po::variables_map& given, const SemanticMapper& mapper, const std::string& frame,
                     const std::vector<DriveRecord>& drives, JournalOutput journal = {}) {
  if (given.count("output") == 0) return;
  const std::string output = given["output"].as<std::string>();
  if (isMapFileName(output) && !journal.empty()) {
    saveWithJournal(output, mapper, frame, drives, std::move(journal));
  } else if (isMapFileName(output)) {
    saveMap(output, mapInfoOf(mapper, frame), drives, mapper.map());
  } else {
    exportMap(output, mapper.map(), mapper.rules(), mapper.classes(),
              parseStates(given["include"].as<std::string>()));
  }
}

}  // namespace bki_mapping::tools
