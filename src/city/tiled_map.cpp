#include "bki_mapping/city/tiled_map.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/store/mapper_file.h"
#include "city/region_files.h"
#include "rules/neighbourhood.h"
#include "store/box_tiles.h"
#include "store/database.h"

namespace bki_mapping {
namespace {

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

}  // namespace

struct TiledMap::State {
  explicit State(const std::string& path) : files(path) {}

  /// The first and the last tile of a box.
  std::optional<std::pair<GridIndex, GridIndex>> tilesOf(const Eigen::AlignedBox3d& box) {
    if (box.min().hasNaN() || box.max().hasNaN())
      throw std::invalid_argument("a corner of the box is not a number");
    return tilesHolding(box, GridGeometry(files.resolution()));
  }
  std::vector<std::size_t> filesIn(const Eigen::AlignedBox3d& box) {
    std::vector<std::size_t> numbers;
    const auto range = tilesOf(box);
    if (!range) return numbers;
    const auto& [first, last] = *range;
    for (std::size_t n = 0; n < files.count(); ++n) {
      const auto [low, high] = files.cornersOf(n);
      const bool apart = low.x > last.x || high.x < first.x || low.y > last.y || high.y < first.y;
      if (!apart) numbers.push_back(n);
    }
    return numbers;
  }
  std::vector<TileEntry> tilesIn(const Eigen::AlignedBox3d& box, std::size_t n) {
    const auto range = tilesOf(box);
    return range ? files.file(n).tilesIn(range->first, range->second) : std::vector<TileEntry>();
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
      if (const auto region = files.regionOf(tile)) by_file.emplace_back(*region, tile);
    }
    std::sort(by_file.begin(), by_file.end());
    by_file.erase(std::unique(by_file.begin(), by_file.end()), by_file.end());
    std::vector<Found> found;
    for (const auto& [n, tile] : by_file) {
      if (const auto entry = files.file(n).findTile({tile})) found.push_back({n, *entry});
    }
    return found;
  }

  void checkMemory(const std::vector<Found>& found, std::size_t bytes, std::size_t limit) const {
    if (limit == 0 || bytes <= limit) return;
    throw MapFileError("the " + std::to_string(found.size()) + " tiles of " + files.path() +
                       " that are asked for take " + std::to_string(bytes / 1'000'000) +
                       " MB of memory, and the limit is " + std::to_string(limit / 1'000'000) +
                       " MB; ask for a smaller box, or raise the limit");
  }
  RuledMap read(const std::vector<Found>& found, std::size_t limit) {
    const MapInfo& info = files.info();
    std::size_t bytes = 0;
    for (const Found& each : found) bytes += memoryOf(each.entry);
    checkMemory(found, bytes, limit);
    RuledMap stored{{info, {}, info.emptyMap()}, storedRules(files.infoPath(), info)};
    for (const Found& each : found) {
      if (!files.file(each.file).addTileTo(stored.map, {each.entry.index})) {
        throw damaged(files.nameOf(each.file), "a tile of its list is missing");
      }
      ++tiles_read;
      bytes += memoryOfLooks(stored.map, each.entry.index);
      checkMemory(found, bytes, limit);
    }
    std::set<std::size_t> numbers;
    for (const Found& each : found) numbers.insert(each.file);
    if (files.isMapFile()) numbers.insert(0);
    std::map<std::string, DriveRecord> of_files;
    for (const std::size_t n : numbers) {
      for (const DriveRecord& drive : files.file(n).drives()) of_files.emplace(drive.id, drive);
    }
    for (auto& [id, drive] : of_files) stored.drives.push_back(std::move(drive));
    return stored;
  }

  RegionFiles files;
  std::uint64_t tiles_read = 0;
};

TiledMap::TiledMap(const std::string& path) : state_(std::make_unique<State>(path)) {}
TiledMap::~TiledMap() = default;
TiledMap::TiledMap(TiledMap&&) noexcept = default;
TiledMap& TiledMap::operator=(TiledMap&&) noexcept = default;

const std::string& TiledMap::path() const {
  return state_->files.path();
}
bool TiledMap::isCity() const {
  return !state_->files.isMapFile();
}
const std::vector<CityRegion>& TiledMap::regions() const {
  return state_->files.index().regions;
}
std::int32_t TiledMap::regionTiles() const {
  return state_->files.index().region_tiles;
}
const std::vector<std::string>& TiledMap::driveNames() const {
  return state_->files.index().drives;
}
const std::set<std::string>& TiledMap::driveIds() const {
  return state_->files.index().pieces;
}
std::uint64_t TiledMap::tileCount() const {
  return state_->files.tileCount();
}
std::size_t TiledMap::fileCount() const {
  return state_->files.count();
}
double TiledMap::resolution() {
  return state_->files.resolution();
}
const MapInfo& TiledMap::info() {
  return state_->files.info();
}
MapFile* TiledMap::file() {
  return state_->files.isMapFile() ? &state_->files.file(0) : nullptr;
}

RuledMap TiledMap::readBox(const Eigen::AlignedBox3d& box, std::size_t memory_limit) {
  RuledMap stored = state_->read(state_->find(box), memory_limit);
  keepOnly(box, stored.map);
  return stored;
}

RuledMap TiledMap::readTiles(const std::vector<GridIndex>& tiles, std::size_t memory_limit) {
  return state_->read(state_->find(tiles), memory_limit);
}

RuledMap TiledMap::readTilesAt(const std::vector<Eigen::Vector3d>& points, std::size_t memory_limit) {
  const GridGeometry grid(resolution());
  const StateRules rules = storedRules(path(), info());
  const bool asks = rules.neighbourhoodRatio() > 0.0f;  // states depend on voxels around
  std::vector<GridIndex> tiles;
  for (const Eigen::Vector3d& point : points) {
    if (!point.allFinite()) throw std::invalid_argument("a coordinate of a point is not a finite number");
    if (!grid.contains(point)) continue;
    const VoxelIndex voxel = grid.voxelAt(point);
    for (int corner = 0; corner < (asks ? 8 : 1); ++corner) {
      const int reach = asks ? rules.neighbourhoodReach() : 0;
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
  return {state_->files.openedCount(), state_->tiles_read};
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
