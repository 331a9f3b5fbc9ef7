#include "journal/stored_journal.h"

#include <algorithm>
#include <map>
#include <utility>

#include "journal/stored_settings.h"
#include "store/box_tiles.h"

namespace bki_mapping {
namespace {

/// The tiles of a file that a box of whole blocks reaches into.
std::vector<GridIndex> tilesReached(MapFile& file, const Eigen::AlignedBox3d& box) {
  std::vector<GridIndex> tiles;
  if (box.isEmpty()) return tiles;
  const double resolution = file.info().resolution, edge = kTileEdge * resolution;
  // Boxes that only share a face hold no common block.
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(resolution);
  const Eigen::AlignedBox3d inside(box.min() + margin, box.max() - margin);
  const auto [low, high] = tilesAbout(box, resolution);
  for (const TileEntry& tile : file.tilesIn(low, high)) {
    const Eigen::Vector3d corner = edge * Eigen::Vector3d(tile.index.x, tile.index.y, tile.index.z);
    const Eigen::AlignedBox3d space(corner, corner + Eigen::Vector3d::Constant(edge));
    if (space.intersects(inside)) tiles.push_back(tile.index);
  }
  return tiles;
}

/// Notes where drives have scans that the journal lacks. @param kept number of scans in it, by drive.
void noteLacking(MapFile& file, const std::map<std::string, std::uint64_t>& kept, MapCorrector& corrector) {
  for (const DriveRecord& drive : file.drives()) {
    const auto found = kept.find(drive.id);
    if (drive.scans != (found == kept.end() ? 0 : found->second)) {
      corrector.noteForeign(tilesReached(file, drive.bounds));
    }
  }
}

std::size_t numberOf(const std::string& sensor, std::vector<std::string>& sensors) {
  const auto known = std::find(sensors.begin(), sensors.end(), sensor);
  const auto number = static_cast<std::size_t>(known - sensors.begin());
  if (known == sensors.end()) sensors.push_back(sensor);
  return number;
}

/// The scan of a row, as it is in the map.
JournalScan scanOf(const ScanRecord& record, std::string content,
                   const std::shared_ptr<const MapperConfig>& settings, std::size_t sensor) {
  JournalScan scan;
  scan.stamp = record.stamp;
  scan.packed = std::make_shared<const std::string>(std::move(content));
  scan.settings = settings;
  scan.sensor = sensor;
  scan.T_map_sensor = record.T_map_sensor;
  scan.T_odometry_sensor = record.T_odometry_sensor;
  scan.reach = record.reach;
  scan.regions = record.tiles;
  scan.cleared_before = static_cast<std::size_t>(record.cleared);
  return scan;
}

}  // namespace

ScanRecord recordOf(const JournalScan& scan, const StoredAs& stored) {
  ScanRecord record;
  record.number = stored.number;
  record.drive = stored.drive;
  record.stamp = scan.stamp;
  record.sensor = stored.sensor;
  record.settings = stored.settings;
  record.cleared = stored.first_cleared + static_cast<int>(scan.cleared_before);
  record.jump = stored.jump;
  record.reach = scan.reach;
  record.T_map_sensor = scan.T_map_sensor;
  record.T_odometry_sensor = scan.T_odometry_sensor;
  record.tiles = scan.regions;
  return record;
}

std::vector<StoredAs> restoreJournal(MapFile& file, MapCorrector& corrector) {
  std::vector<StoredAs> restored;
  std::vector<std::string> sensors;
  const auto settings = journalSettings(file);
  for (const Eigen::AlignedBox3d& box : file.clearedBoxes()) corrector.noteCleared(box);
  std::map<std::string, std::uint64_t> kept;
  for (const ScanRecord& record : file.scans()) {
    ++kept[record.drive];
    if (record.jump) corrector.noteJump(record.stamp);
    corrector.restore(scanOf(record, file.scanContent(record.number),
                             settings[static_cast<std::size_t>(record.settings)],
                             numberOf(record.sensor, sensors)));
    restored.push_back({record.number, record.drive, record.sensor, record.settings, 0, record.jump});
  }
  noteLacking(file, kept, corrector);
  return restored;
}

Eigen::AlignedBox3d boundsIn(const SemanticMap& map, const std::vector<GridIndex>& tiles) {
  Eigen::AlignedBox3d bounds;
  for (const GridIndex& tile : tiles) {
    const Region* const region = map.findRegion(tile);
    if (region == nullptr) continue;
    region->forEachIndex([&](const BlockIndex& block) {
      const Eigen::Vector3d low = map.geometry().blockOrigin(block);
      bounds.extend(low);
      bounds.extend(low + Eigen::Vector3d::Constant(map.geometry().blockSize()));
    });
  }
  return bounds;
}

}  // namespace bki_mapping
