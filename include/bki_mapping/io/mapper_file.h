/// @file Keeps the map of a mapper in a map file (.bkm), and resumes from it.
#pragma once

#include <string>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Whether a path ends in .bkm.
bool isMapFileName(const std::string& path);

/// What a map file says of a mapper's map. @param frame name of the map frame.
MapInfo mapInfoOf(const SemanticMapper& mapper, const std::string& frame);

/// Loads a map file, to be added to a mapper's map: StoredMap::map goes to SemanticMapper::addMap.
/// @param frame of the mapper; "": any.
/// @throws MapFileError as loadMap; with memory_limit as the limit; and if the file has another frame,
/// resolution, unit, prior or class table than the mapper: in one sentence with both values.
StoredMap loadMapFor(const SemanticMapper& mapper, const std::string& path, const std::string& frame);

/// An empty map as MapInfo::emptyMap, with the gains that the parameters and the class table of a file set,
/// so that voxels have the states that the mapper gave them. Parameters that this version does not know are
/// ignored. @param path of the file, for errors. @throws MapFileError if the parameters are no YAML.
SemanticMap emptyMapWithGains(const std::string& path, const MapInfo& info);

}  // namespace bki_mapping
