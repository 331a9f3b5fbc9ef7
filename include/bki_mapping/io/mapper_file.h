/// @file Keeps the map of a mapper in a map file (.bkm), and resumes from it.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Whether a path ends in .bkm.
bool isMapFileName(const std::string& path);

/// What a map file says of a mapper's map. @param frame name of the map frame.
MapInfo mapInfoOf(const SemanticMapper& mapper, const std::string& frame);

/// Collects what a map file says of a drive, scan by scan.
class DriveLog {
 public:
  DriveLog(std::string id, std::string name) {
    record_.id = std::move(id);
    record_.name = std::move(name);
  }
  /// @param stamp of the scan [ns]. @param mapper has just integrated it.
  void addScan(std::uint64_t stamp, const SemanticMapper& mapper);
  const DriveRecord& record() const { return record_; }

 private:
  DriveRecord record_;
};

/// Loads a map file, to be added to a mapper's map: StoredMap::map goes to SemanticMapper::addMap.
/// @param frame of the mapper; "": any.
/// @throws MapFileError as loadMap; with memory_limit as the limit; and if the file has another frame,
/// resolution, unit, prior or class table than the mapper: in one sentence with both values.
StoredMap loadMapFor(const SemanticMapper& mapper, const std::string& path, const std::string& frame);

/// Adds drives to others. @throws std::invalid_argument if one of them, by its id, is among the others.
void addDrives(std::vector<DriveRecord>& drives, const std::vector<DriveRecord>& others);

}  // namespace bki_mapping
