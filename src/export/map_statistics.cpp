#include "export/map_statistics.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "export/ordered_json.h"

namespace bki_mapping {
namespace {

void extend(MapStatistics& statistics, const VoxelIndex& voxel) {
  GridIndex &low = statistics.low, &high = statistics.high;
  if (low.x > high.x) low = high = voxel;
  low = {std::min(low.x, voxel.x), std::min(low.y, voxel.y), std::min(low.z, voxel.z)};
  high = {std::max(high.x, voxel.x), std::max(high.y, voxel.y), std::max(high.z, voxel.z)};
}

void count(MapStatistics& statistics, const BlockIndex& index, const BlockView& view) {
  for (int offset = 0; offset < kBlockVoxels; ++offset) {
    const auto v = static_cast<std::size_t>(offset);
    switch (view.state[v]) {
      case VoxelState::kUnknown:
        continue;
      case VoxelState::kFree:
        ++statistics.free;
        break;
      case VoxelState::kOccluded:
        ++statistics.occluded;
        break;
      case VoxelState::kOccupied:
        ++statistics.occupied;
        ++statistics.occupied_by_class[view.label[v]];
        break;
    }
    extend(statistics, GridGeometry::voxelOf(index, offset));
  }
}

/// Counts blocks of a map.
void countAll(MapStatistics& statistics, const SemanticMap& map, const StateRules& rules,
              const std::vector<std::pair<BlockIndex, const Block*>>& blocks, const BlockVisit& visit) {
  BlockView view;
  for (const auto& [index, block] : blocks) {
    ++statistics.blocks;
    statistics.planes += block->classes().size();
    statistics.memory_bytes += block->bytes();
    readBlock(map, rules, index, *block, BlockFields::kStates, view);
    count(statistics, index, view);
    if (visit) visit(index, view);
  }
}

/// The tiles of a file one after another, each with those beside it where their evidence decides states in
/// it. They are visited in strips along y, a few tiles wide, so that a tile serves all its neighbours: it is
/// read once, or twice at the edge of a strip. Three rows of a strip, with tiles of all heights, are in
/// memory at once; without neighbours, one tile.
class TileWindow {
 public:
  TileWindow(MapFile& file, const StateRules& rules)
      : file_(file), map_(file.info().emptyMap()), asks_around_(rules.neighbourhoodRatio() > 0.0f) {
    for (const TileEntry& tile : file.tiles()) tiles_.push_back(tile.index);
    std::sort(tiles_.begin(), tiles_.end(), [](const GridIndex& a, const GridIndex& b) {
      return std::make_tuple(stripOf(a), a.y, a.x, a.z) < std::make_tuple(stripOf(b), b.y, b.x, b.z);
    });
  }

  const std::vector<GridIndex>& tiles() const { return tiles_; }
  const SemanticMap& map() const { return map_; }

  /// Reads what decides the states in a tile, and forgets what no later tile needs.
  void moveTo(const GridIndex& tile) {
    const std::int32_t beside = asks_around_ ? 1 : 0, strip = stripOf(tile) * kStrip;
    for (const GridIndex& held : map_.regions()) {
      if (beside == 0 || held.x < strip - beside || held.x >= strip + kStrip + beside ||
          std::abs(held.y - tile.y) > beside) {
        map_.takeRegion(held);
      }
    }
    for (std::int32_t x = tile.x - beside; x <= tile.x + beside; ++x) {
      for (std::int32_t y = tile.y - beside; y <= tile.y + beside; ++y) {
        for (std::int32_t z = tile.z - beside; z <= tile.z + beside; ++z) {
          if (!map_.hasRegion({x, y, z})) file_.addTileTo(map_, {GridIndex{x, y, z}});
        }
      }
    }
  }

  /// The blocks of a tile.
  std::vector<std::pair<BlockIndex, const Block*>> blocksOf(const GridIndex& tile) const {
    std::vector<std::pair<BlockIndex, const Block*>> blocks;
    if (const Region* const region = map_.findRegion(tile)) {
      region->forEachIndex([&](const BlockIndex& index) { blocks.emplace_back(index, map_.find(index)); });
    }
    return blocks;
  }

 private:
  static constexpr std::int32_t kStrip = 8;  // tiles
  static std::int32_t stripOf(const GridIndex& tile) {
    return tile.x >= 0 ? tile.x / kStrip : -1 - (-1 - tile.x) / kStrip;
  }

  MapFile& file_;
  SemanticMap map_;
  bool asks_around_;  ///< whether states depend on the tiles beside
  std::vector<GridIndex> tiles_;
};

using Json = OrderedJson;

Json boxJson(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return nullptr;
  const Eigen::Vector3d &low = box.min(), &high = box.max();
  return {{"min", {low.x(), low.y(), low.z()}}, {"max", {high.x(), high.y(), high.z()}}};
}

Json driveJson(const DriveRecord& drive) {
  return {{"id", drive.id},
          {"name", drive.name},
          {"part", drive.part},
          {"scans", drive.scans},
          {"first_stamp_ns", drive.first_stamp},
          {"last_stamp_ns", drive.last_stamp},
          {"bounds", boxJson(drive.bounds)}};
}

}  // namespace

Eigen::AlignedBox3d MapStatistics::bounds(double resolution) const {
  if (low.x > high.x) return {};
  return {resolution * Eigen::Vector3d(low.x, low.y, low.z),
          resolution * Eigen::Vector3d(high.x + 1.0, high.y + 1.0, high.z + 1.0)};
}

JournalStatistics readJournalStatistics(MapFile& file) {
  JournalStatistics found;
  if (!file.hasJournal()) return found;
  std::set<std::string> drives;
  for (const ScanRecord& scan : file.scans()) {
    drives.insert(scan.drive);
    found.bytes += scan.bytes;
    ++found.scans;
  }
  found.drives = drives.size();
  return found;
}

MapStatistics readStatistics(MapFile& file, const StateRules& rules, const BlockVisit& visit) {
  MapStatistics statistics;
  TileWindow window(file, rules);
  for (const GridIndex& tile : window.tiles()) {
    window.moveTo(tile);
    ++statistics.tiles;
    countAll(statistics, window.map(), rules, window.blocksOf(tile), visit);
  }
  return statistics;
}

MapStatistics statisticsOf(const SemanticMap& map, const StateRules& rules, const BlockVisit& visit) {
  MapStatistics statistics;
  statistics.tiles = map.regions().size();
  countAll(statistics, map, rules, sortedBlocks(map), visit);
  return statistics;
}

std::string statisticsJson(MapFile& file, const MapStatistics& found, const std::vector<DriveRecord>& drives,
                           const JournalStatistics& journal) {
  const MapInfo& info = file.info();
  const auto bytes = file.size().bytes;
  Json by_class = Json::object(), drive_list = Json::array();
  for (const SemanticClass& c : info.classes->classes()) {
    const auto count = found.occupied_by_class.find(c.id);
    by_class[c.name] = count == found.occupied_by_class.end() ? 0 : count->second;
  }
  for (const DriveRecord& drive : drives) drive_list.push_back(driveJson(drive));
  const Json per_voxel = found.known() > 0 ? Json(found.bytesPerKnownVoxel(bytes)) : Json();
  return Json{{"file", file.path()},
              {"program", info.program},
              {"frame", info.frame},
              {"resolution", info.resolution},
              {"prior", info.prior},
              {"class_table", info.classes->name()},
              {"bounds", boxJson(found.bounds(info.resolution))},
              {"voxels", {{"free", found.free}, {"occupied", found.occupied}, {"occluded", found.occluded}}},
              {"voxels_by_class", by_class},
              {"blocks", found.blocks},
              {"tiles", found.tiles},
              {"file_bytes", bytes},
              {"map_bytes", found.memory_bytes},
              {"file_bytes_per_known_voxel", per_voxel},
              {"drives", drive_list},
              {"journal", {{"scans", journal.scans}, {"bytes", journal.bytes}, {"drives", journal.drives}}}}
             .dump(2) +
         "\n";
}

}  // namespace bki_mapping
