#include "bki_mapping/store/map_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "bki_mapping/map/semantic_map.h"
#include "store/box_tiles.h"

namespace bki_mapping {
namespace {

/// Clears a box in all parts. @param copies whether to write unchanged tiles, too.
ClearedFile clearParts(MapFile& file, const Eigen::AlignedBox3d& box, MapFile::Change& change, bool copies) {
  ClearedFile cleared;
  const auto [low, high] = tilesAbout(box, file.info().resolution);
  for (const int part : file.parts()) {
    for (const TileEntry& tile : copies ? file.tiles(part) : file.tilesIn(low, high, part)) {
      SemanticMap map = file.info().emptyMap();
      file.addTileTo(map, {tile.index, part});
      const std::size_t blocks = clearBox(map, box).size();
      if (blocks > 0 || copies) change.writeTile(map, {tile.index, part});
      if (part > 0) continue;
      cleared.blocks += blocks;
      cleared.tiles += blocks > 0;
    }
  }
  return cleared;
}

/// Scans of the journal have no evidence in the box any more, wherever they move.
void noteCleared(MapFile& file, const Eigen::AlignedBox3d& box, MapFile::Change& change) {
  if (!file.scans().empty()) change.addClearedBox(box);
}

}  // namespace

ClearedFile clearBoxOfFile(const std::string& path, const Eigen::AlignedBox3d& box,
                           const std::string& output) {
  if (box.min().hasNaN() || box.max().hasNaN())
    throw std::invalid_argument("a corner of the box is not a number");
  std::error_code missing;
  if (output.empty() || std::filesystem::equivalent(path, output, missing)) {
    MapFile file(path, MapFile::Access::kUpdate);
    MapFile::Change change = file.change();
    const ClearedFile cleared = clearParts(file, box, change, false);
    noteCleared(file, box, change);
    change.commit();
    return cleared;
  }
  MapFile file(path, MapFile::Access::kRead);
  NewMapFile copy(output, file.info());
  for (const DriveRecord& drive : file.drives()) copy.content().putDrive(drive);
  const ClearedFile cleared = clearParts(file, box, copy.content(), true);
  copyJournal(file, copy.content());
  noteCleared(file, box, copy.content());
  copy.commit();
  return cleared;
}

}  // namespace bki_mapping
