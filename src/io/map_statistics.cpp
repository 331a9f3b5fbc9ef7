#include "io/map_statistics.h"

#include <algorithm>

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

/// Counts the blocks of a map. @param tile only those in this one.
void countAll(MapStatistics& statistics, const SemanticMap& map, const BlockVisit& visit,
              const GridIndex* tile = nullptr) {
  BlockView view;
  for (const auto& [index, block] : sortedBlocks(map)) {
    if (tile && SemanticMap::regionOf(index) != *tile) continue;
    ++statistics.blocks;
    statistics.planes += block->classes().size();
    statistics.memory_bytes += block->bytes();
    readBlock(map, index, *block, BlockFields::kStates, view);
    count(statistics, index, view);
    if (visit) visit(index, view);
  }
}

/// Adds the tiles whose evidence may decide states in a tile.
void addTilesAround(const GridIndex& tile, MapFile& file, SemanticMap& map) {
  for (int n = 0; n < 27; ++n) {
    const GridIndex beside{tile.x + n % 3 - 1, tile.y + n / 3 % 3 - 1, tile.z + n / 9 - 1};
    if (beside != tile) file.addTileTo(map, {beside});
  }
}

}  // namespace

Eigen::AlignedBox3d MapStatistics::bounds(double resolution) const {
  if (low.x > high.x) return {};
  return {resolution * Eigen::Vector3d(low.x, low.y, low.z),
          resolution * Eigen::Vector3d(high.x + 1.0, high.y + 1.0, high.z + 1.0)};
}

MapStatistics readStatistics(MapFile& file, SemanticMap& empty_map, const BlockVisit& visit) {
  MapStatistics statistics;
  for (const TileEntry& tile : file.tiles()) {
    SemanticMap map = empty_map.snapshot();
    file.addTileTo(map, {tile.index});
    if (empty_map.neighbourhoodRatio() > 0.0f) addTilesAround(tile.index, file, map);
    ++statistics.tiles;
    countAll(statistics, map, visit, &tile.index);
  }
  return statistics;
}

MapStatistics statisticsOf(const SemanticMap& map, const BlockVisit& visit) {
  MapStatistics statistics;
  statistics.tiles = map.regions().size();
  countAll(statistics, map, visit);
  return statistics;
}

}  // namespace bki_mapping
