/// @file The index of a city: index.json, as map_city writes it.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/city/tiled_map.h"

namespace bki_mapping {

struct CityIndex {
  std::int32_t region_tiles = 0;     ///< edge of a region [tiles]
  std::optional<double> resolution;  ///< edge of a voxel [m], if the index says it
  std::vector<CityRegion> regions;   ///< sorted by x, then y; no two at the same place
  std::vector<std::string> drives;   ///< names, sorted
  std::set<std::string> pieces;      ///< ids of all pieces
};

/// Reads an index, whose content is not trusted: at most 64 MB, 2,000,000 values and 16 levels, no key twice,
/// and files of regions in the folder `regions` only.
/// @throws MapFileError in one sentence.
CityIndex readCityIndex(const std::string& path);

}  // namespace bki_mapping
