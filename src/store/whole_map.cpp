// Whole maps: what map files hold, in memory at once.
#include <algorithm>
#include <stdexcept>

#include "bki_mapping/store/map_file.h"
#include "store/database.h"

namespace bki_mapping {
namespace {

/// @param bytes that the map takes. @param limit for them; 0: no limit.
void checkMemory(const std::string& path, std::size_t bytes, std::size_t limit) {
  if (limit == 0 || bytes <= limit) return;
  throw MapFileError("the map in " + path + " takes " + std::to_string(bytes / 1'000'000) +
                     " MB of memory, and the limit is " + std::to_string(limit / 1'000'000) +
                     " MB; raise the limit, or use a smaller map");
}

}  // namespace

void saveMap(const std::string& path, const MapInfo& info, const std::vector<DriveRecord>& drives,
             const SemanticMap& map) {
  MapInfo of_map = info;
  of_map.resolution = map.geometry().resolution();
  of_map.prior = map.prior();
  NewMapFile file(path, of_map);
  for (DriveRecord drive : drives) {
    drive.part = 0;
    file.content().putDrive(drive);
  }
  for (const GridIndex& tile : tilesOf(map)) file.content().writeTile(map, {tile});
  file.commit();
}

void copyMap(MapFile& file, const std::string& path) {
  NewMapFile copy(path, file.info());
  for (const DriveRecord& drive : file.drives()) copy.content().putDrive(drive);
  for (const int part : file.parts()) {
    for (const TileEntry& tile : file.tiles(part)) {
      SemanticMap map = file.info().emptyMap();
      file.addTileTo(map, {tile.index, part});
      copy.content().writeTile(map, {tile.index, part});
    }
  }
  copyJournal(file, copy.content());
  copy.commit();
}

void copyJournal(MapFile& file, MapFile::Change& copy) {
  for (const std::string& parameters : file.settings()) copy.addSettings(parameters);
  for (const Eigen::AlignedBox3d& box : file.clearedBoxes()) copy.addClearedBox(box);
  for (const ScanRecord& scan : file.scans()) copy.addScan(scan, file.scanContent(scan.number));
}

StoredMap loadMap(const std::string& path, std::size_t memory_limit) {
  MapFile file(path, MapFile::Access::kRead);
  return readMap(file, memory_limit);
}

StoredMap readMap(MapFile& file, std::size_t memory_limit) {
  StoredMap stored{file.info(), file.drives(), file.info().emptyMap()};
  for (DriveRecord& drive : stored.drives) drive.part = 0;
  const std::vector<TileEntry> tiles = file.tiles();
  std::size_t bytes = 0;
  for (const TileEntry& tile : tiles) bytes += memoryOf(tile);
  checkMemory(file.path(), bytes, memory_limit);
  for (const TileEntry& tile : tiles) {
    if (!file.addTileTo(stored.map, {tile.index})) {
      throw damaged(file.path(), "a tile of its list is missing");
    }
    bytes += memoryOfLooks(stored.map, tile.index);
    checkMemory(file.path(), bytes, memory_limit);
  }
  return stored;
}

void checkFits(const MapFile& file, const MapInfo& own) {
  if (!own.frame.empty() && file.info().frame != own.frame) {
    throw MapFileError("the map in " + file.path() + " is in frame '" + file.info().frame +
                       "', and the mapper maps in '" + own.frame + "'; set frame_id to the frame of the map");
  }
  try {
    checkSameGrid(file.path(), file.info(), "the mapper", own);
  } catch (const std::invalid_argument& difference) {
    throw MapFileError(difference.what());
  }
}

std::size_t memoryOf(const TileEntry& tile) {
  return static_cast<std::size_t>(tile.planes) * kBlockVoxels * sizeof(EvidenceUnits) +
         static_cast<std::size_t>(tile.blocks) * (sizeof(Block) + kReferenceCountBytes);
}

std::size_t memoryOfLooks(const SemanticMap& map, const GridIndex& tile) {
  std::size_t bytes = 0;
  const Region* const region = map.findRegion(tile);
  for (int number = 0; region && number < Region::kBlocks; ++number) {
    if (region->has(number)) bytes += region->find(number)->looks().bytes();
  }
  return bytes;
}

std::vector<GridIndex> tilesOf(const SemanticMap& map) {
  std::vector<GridIndex> tiles = map.regions();
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

}  // namespace bki_mapping
