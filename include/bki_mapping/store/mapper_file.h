/// @file Keeps the map of a mapper in a map file (.bkm), and resumes from it.
#pragma once

#include <string>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Whether a path ends in .bkm.
bool isMapFileName(const std::string& path);

/// The info that a map file needs about a mapper's map. @param frame name of the map frame.
MapInfo mapInfoOf(const SemanticMapper& mapper, const std::string& frame);

/// Loads a map file for a mapper; pass StoredMap::map to SemanticMapper::addMap.
/// @param frame the mapper's map frame; "" matches every frame.
/// @throws MapFileError as loadMap, with memory_limit as the limit. @throws MapFileError, in one sentence
/// with both values, if the file has another frame, resolution, unit, prior or class table than the mapper.
StoredMap loadMapFor(const SemanticMapper& mapper, const std::string& path, const std::string& frame);

/// The rules that a file's parameters and class table set, so that voxels have the states that the mapper
/// gave them. Parameters that this version does not know are ignored.
/// @param path of the file, for errors. @throws MapFileError if the parameters are not YAML, or not
/// allowed.
StateRules storedRules(const std::string& path, const MapInfo& info);

/// A stored map with the rules that say what its voxels are.
struct RuledMap : StoredMap {
  StateRules rules;
};

/// Reads a whole map as loadMap, with its rules. TiledMap reads a part of one, or of a city.
/// DriveRecord::part is as in the file. @throws as loadMap and storedRules.
RuledMap loadRuledMap(const std::string& path);

}  // namespace bki_mapping
