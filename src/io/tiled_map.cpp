#include "bki_mapping/io/tiled_map.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/io/mapper_file.h"
#include "bki_mapping/map/semantic_map.h"
#include "io/city_index.h"
#include "map/neighbourhood.h"
#include "store/box_tiles.h"
#include "store/database.h"

namespace bki_mapping {
namespace {

/// Files of regions that stay open. SQLite keeps up to 2 MB of each in memory.
constexpr std::size_t kMostOpen = 16;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A tile, and the number of the file that holds it.
struct Found {
  std::size_t file;
  TileEntry entry;
};

/// Clears what lies outside a box.
void keepOnly(const Eigen::AlignedBox3d& box, SemanticMap& map) {
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::AlignedBox3d below(Eigen::Vector3d::Constant(-kInfinity), Eigen::Vector3d::Constant(kInfinity));
    Eigen::AlignedBox3d above = below;
    below.max()[axis] = std::nextafter(box.min()[axis], -kInfinity);
    above.min()[axis] = std::nextafter(box.max()[axis], kInfinity);
    if (box.min()[axis] > -kInfinity) clearBox(map, below);
    if (box.max()[axis] < kInfinity) clearBox(map, above);
  }
}

std::int32_t floorDivide(std::int32_t dividend, std::int32_t divisor) {
  return dividend / divisor - static_cast<std::int32_t>(dividend % divisor < 0);
}

}  // namespace

struct TiledMap::State {
  explicit State(const std::string& given) : path(given) {
    std::error_code unknown;
    const std::filesystem::path as_path(given);
    if (as_path.filename().empty()) {  // a slash at the end: a folder
      path = as_path.parent_path().string();
    } else if (as_path.filename() == "index.json") {
      path = as_path.parent_path().empty() ? "." : as_path.parent_path().string();
    } else if (!std::filesystem::is_directory(given, unknown)) {
      map_file = true;
      open.emplace_back(0, MapFile(path, MapFile::Access::kRead));
      learn(open.back().second);
      opened.insert(0);
      return;
    }
    index = readCityIndex((std::filesystem::path(path) / "index.json").string());
    for (std::size_t n = 0; n < index.regions.size(); ++n) {
      const CityRegion& region = index.regions[n];
      number.emplace(std::make_pair(region.x, region.y), n);
      tiles += region.tiles;
    }
  }

  std::string nameOf(std::size_t n) const {
    return map_file ? path : (std::filesystem::path(path) / index.regions[n].file).string();
  }
  /// The corner tiles of a region, of every height.
  std::pair<GridIndex, GridIndex> cornersOf(std::size_t n) const {
    constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max() / 2;
    if (map_file) return {{-kMost, -kMost, -kMost}, {kMost, kMost, kMost}};
    const std::int32_t edge = index.region_tiles;
    const CityRegion& region = index.regions[n];
    return {{region.x * edge, region.y * edge, -kMost},
            {region.x * edge + edge - 1, region.y * edge + edge - 1, kMost}};
  }

  MapFile& file(std::size_t n) {
    const auto known =
        std::find_if(open.begin(), open.end(), [&](const auto& each) { return each.first == n; });
    if (known != open.end()) {
      open.splice(open.begin(), open, known);
      return open.front().second;
    }
    MapFile file = openRegion(n);
    if (open.size() >= kMostOpen) open.pop_back();
    open.emplace_front(n, std::move(file));
    opened.insert(n);
    return open.front().second;
  }
  /// Opens the file of a region, and checks that it is what the index says.
  MapFile openRegion(std::size_t n) {
    const std::string name = nameOf(n);
    std::error_code unknown;
    if (!std::filesystem::exists(name, unknown)) {
      throw MapFileError(name +
                         " is missing, although the index of the city lists it; run map_city with "
                         "--resume, or open the city again if it has just been changed");
    }
    MapFile file(name, MapFile::Access::kRead);
    const auto differs = [&](const std::string& what) {
      throw MapFileError(name + " does not fit the index of the city: " + what +
                         "; run map_city with --resume");
    };
    const CityRegion& region = index.regions[n];
    const auto [low, high] = cornersOf(n);
    std::uint64_t blocks = 0;
    const std::vector<TileEntry> entries = file.tiles();
    for (const TileEntry& entry : entries) {
      blocks += static_cast<std::uint64_t>(entry.blocks);
      const GridIndex& t = entry.index;
      if (t.x < low.x || t.x > high.x || t.y < low.y || t.y > high.y)
        differs("a tile lies in another region");
    }
    if (entries.size() != region.tiles || blocks != region.blocks) {
      differs("it has " + std::to_string(entries.size()) + " tiles with " + std::to_string(blocks) +
              " blocks, not " + std::to_string(region.tiles) + " with " + std::to_string(region.blocks));
    }
    for (const DriveRecord& drive : file.drives()) {
      if (index.pieces.count(drive.id) == 0)
        differs("it holds drive '" + drive.id + "', which the index does not list");
    }
    if (index.resolution && *index.resolution != file.info().resolution) {
      differs("its resolution is " + numberText(file.info().resolution) + " m, not " +
              numberText(*index.resolution) + " m");
    }
    if (!info) {
      learn(file);
    } else {
      checkSame(file);
    }
    return file;
  }
  void checkSame(const MapFile& file) const {
    if (file.info().frame != info->frame) {
      throw MapFileError(file.path() + " is in frame '" + file.info().frame + "', and " + info_path +
                         " in frame '" + info->frame + "'; map the city again");
    }
    try {
      checkSameGrid(file.path(), file.info(), info_path, *info);
    } catch (const std::invalid_argument& difference) {
      throw MapFileError(difference.what());
    }
  }
  void learn(MapFile& file) {
    info = file.info();
    info_path = file.path();
    if (map_file) {
      tiles = file.tiles().size();
      for (const DriveRecord& drive : file.drives()) index.pieces.insert(drive.id);
    }
  }
  /// Opens regions until one is sound.
  void learnAnything() {
    std::optional<MapFileError> first;
    for (std::size_t n = 0; n < index.regions.size() && !info; ++n) {
      try {
        file(n);
      } catch (const MapFileError& error) {
        if (!first) first = error;
      }
    }
    if (!info) throw *first;
  }
  double resolution() {
    if (index.resolution) return *index.resolution;
    if (!info) learnAnything();
    return info->resolution;
  }

  /// The first and the last tile of a box.
  std::optional<std::pair<GridIndex, GridIndex>> tilesOf(const Eigen::AlignedBox3d& box) {
    if (box.min().hasNaN() || box.max().hasNaN())
      throw std::invalid_argument("a corner of the box is not a number");
    return tilesHolding(box, GridGeometry(resolution()));
  }
  std::vector<std::size_t> filesIn(const Eigen::AlignedBox3d& box) {
    std::vector<std::size_t> files;
    const auto range = tilesOf(box);
    if (!range) return files;
    const auto& [first, last] = *range;
    for (std::size_t n = 0; n < (map_file ? 1 : index.regions.size()); ++n) {
      const auto [low, high] = cornersOf(n);
      const bool apart = low.x > last.x || high.x < first.x || low.y > last.y || high.y < first.y;
      if (!apart) files.push_back(n);
    }
    return files;
  }
  std::vector<TileEntry> tilesIn(const Eigen::AlignedBox3d& box, std::size_t n) {
    const auto range = tilesOf(box);
    return range ? file(n).tilesIn(range->first, range->second) : std::vector<TileEntry>();
  }
  std::vector<Found> find(const Eigen::AlignedBox3d& box) {
    std::vector<Found> found;
    for (const std::size_t n : filesIn(box)) {
      for (const TileEntry& entry : tilesIn(box, n)) found.push_back({n, entry});
    }
    return found;
  }
  std::vector<Found> find(const std::vector<GridIndex>& wanted) {
    std::vector<std::pair<std::size_t, GridIndex>> by_file;
    for (const GridIndex& tile : wanted) {
      if (map_file) {
        by_file.emplace_back(0, tile);
        continue;
      }
      const auto region =
          number.find({floorDivide(tile.x, index.region_tiles), floorDivide(tile.y, index.region_tiles)});
      if (region != number.end()) by_file.emplace_back(region->second, tile);
    }
    std::sort(by_file.begin(), by_file.end());
    by_file.erase(std::unique(by_file.begin(), by_file.end()), by_file.end());
    std::vector<Found> found;
    for (const auto& [n, tile] : by_file) {
      if (const auto entry = file(n).findTile({tile})) found.push_back({n, *entry});
    }
    return found;
  }

  void checkMemory(const std::vector<Found>& found, std::size_t limit) const {
    std::size_t bytes = 0;
    for (const Found& each : found) bytes += memoryOf(each.entry);
    if (limit == 0 || bytes <= limit) return;
    throw MapFileError("the " + std::to_string(found.size()) + " tiles of " + path +
                       " that are asked for take " + std::to_string(bytes / 1'000'000) +
                       " MB of memory, and the limit is " + std::to_string(limit / 1'000'000) +
                       " MB; ask for a smaller box, or raise the limit");
  }
  StoredMap read(const std::vector<Found>& found, std::size_t limit) {
    if (!info) learnAnything();
    checkMemory(found, limit);
    StoredMap stored{*info, {}, emptyMapWithGains(info_path, *info)};
    for (const Found& each : found) {
      if (!file(each.file).addTileTo(stored.map, {each.entry.index})) {
        throw damaged(nameOf(each.file), "a tile of its list is missing");
      }
      ++tiles_read;
    }
    std::set<std::size_t> files;
    for (const Found& each : found) files.insert(each.file);
    if (map_file) files.insert(0);
    std::map<std::string, DriveRecord> of_files;
    for (const std::size_t n : files) {
      for (const DriveRecord& drive : file(n).drives()) of_files.emplace(drive.id, drive);
    }
    for (auto& [id, drive] : of_files) stored.drives.push_back(std::move(drive));
    return stored;
  }

  std::string path;
  bool map_file = false;
  CityIndex index;  ///< of a map file: only the ids of its drives, as pieces
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> number;  ///< of each region in the index
  std::uint64_t tiles = 0;
  std::list<std::pair<std::size_t, MapFile>> open;  ///< by number, the last used first
  std::set<std::size_t> opened;                     ///< numbers of all files that have been opened
  std::uint64_t tiles_read = 0;
  std::optional<MapInfo> info;  ///< of the file `info_path`, the first that was opened
  std::string info_path;
};

TiledMap::TiledMap(const std::string& path) : state_(std::make_unique<State>(path)) {}
TiledMap::~TiledMap() = default;
TiledMap::TiledMap(TiledMap&&) noexcept = default;
TiledMap& TiledMap::operator=(TiledMap&&) noexcept = default;

const std::string& TiledMap::path() const {
  return state_->path;
}
bool TiledMap::isCity() const {
  return !state_->map_file;
}
const std::vector<CityRegion>& TiledMap::regions() const {
  return state_->index.regions;
}
std::int32_t TiledMap::regionTiles() const {
  return state_->index.region_tiles;
}
const std::vector<std::string>& TiledMap::driveNames() const {
  return state_->index.drives;
}
const std::set<std::string>& TiledMap::driveIds() const {
  return state_->index.pieces;
}
std::uint64_t TiledMap::tileCount() const {
  return state_->tiles;
}
std::size_t TiledMap::fileCount() const {
  return state_->map_file ? 1 : state_->index.regions.size();
}
double TiledMap::resolution() {
  return state_->resolution();
}
const MapInfo& TiledMap::info() {
  if (!state_->info) state_->learnAnything();
  return *state_->info;
}
MapFile* TiledMap::file() {
  return state_->map_file ? &state_->file(0) : nullptr;
}

StoredMap TiledMap::readBox(const Eigen::AlignedBox3d& box, std::size_t memory_limit) {
  StoredMap stored = state_->read(state_->find(box), memory_limit);
  keepOnly(box, stored.map);
  return stored;
}

StoredMap TiledMap::readTiles(const std::vector<GridIndex>& tiles, std::size_t memory_limit) {
  return state_->read(state_->find(tiles), memory_limit);
}

StoredMap TiledMap::readTilesAt(const std::vector<Eigen::Vector3d>& points, std::size_t memory_limit) {
  const GridGeometry grid(resolution());
  const bool asks =
      emptyMapWithGains(path(), info()).neighbourhoodRatio() > 0.0f;  // states depend on voxels around
  std::vector<GridIndex> tiles;
  for (const Eigen::Vector3d& point : points) {
    if (!point.allFinite()) throw std::invalid_argument("a coordinate of a point is not a finite number");
    if (!grid.contains(point)) continue;
    const VoxelIndex voxel = grid.voxelAt(point);
    for (int corner = 0; corner < (asks ? 8 : 1); ++corner) {
      const int reach = asks ? kNeighbourhoodReach : 0;
      const auto at = [&](std::int32_t centre, int bit) {
        return centre + (corner >> bit & 1 ? reach : -reach);
      };
      const GridIndex tile = tileOf(VoxelIndex{{at(voxel.x, 0), at(voxel.y, 1), at(voxel.z, 2)}});
      if (tiles.empty() || tiles.back() != tile) tiles.push_back(tile);
    }
  }
  return readTiles(tiles, memory_limit);
}

std::vector<TileEntry> TiledMap::tilesIn(const Eigen::AlignedBox3d& box) {
  std::vector<TileEntry> entries;
  for (const Found& found : state_->find(box)) entries.push_back(found.entry);
  return entries;
}

std::vector<std::size_t> TiledMap::filesIn(const Eigen::AlignedBox3d& box) {
  return state_->filesIn(box);
}

std::vector<TileEntry> TiledMap::tilesIn(const Eigen::AlignedBox3d& box, std::size_t file) {
  return state_->tilesIn(box, file);
}

TiledMap::Reading TiledMap::reading() const {
  return {state_->opened.size(), state_->tiles_read};
}

std::string cityAround(const std::string& path) {
  std::error_code unknown;
  std::filesystem::path folder =
      std::filesystem::weakly_canonical(std::filesystem::absolute(path, unknown), unknown);
  while (!folder.empty()) {
    if (std::filesystem::is_regular_file(folder / "index.json", unknown) &&
        std::filesystem::is_directory(folder / "regions", unknown)) {
      return folder.string();
    }
    if (folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
  return "";
}

}  // namespace bki_mapping
