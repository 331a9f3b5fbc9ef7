/// @file Copies of map files that are not whole.
#pragma once

#include "bki_mapping/store/map_file.h"

namespace bki_mapping::tools {

/// Adds the drives of a file, and the tiles of its parts from a number on, to a new file.
/// @throws MapFileError.
inline void copyParts(MapFile& file, int first_part, MapFile::Change& copy) {
  for (const DriveRecord& drive : file.drives()) copy.putDrive(drive);
  for (const int part : file.parts()) {
    if (part < first_part) continue;
    for (const TileEntry& tile : file.tiles(part)) {
      SemanticMap map = file.info().emptyMap();
      file.addTileTo(map, {tile.index, part});
      copy.writeTile(map, {tile.index, part});
    }
  }
}

}  // namespace bki_mapping::tools
