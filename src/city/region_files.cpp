#include "city/region_files.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {
namespace {

/// Files of regions that stay open. SQLite keeps up to 2 MB of each in memory.
constexpr std::size_t kMostOpen = 16;

std::int32_t floorDivide(std::int32_t dividend, std::int32_t divisor) {
  return dividend / divisor - static_cast<std::int32_t>(dividend % divisor < 0);
}

[[noreturn]] void throwDiffers(const std::string& name, const std::string& what) {
  throw MapFileError(name + " does not fit the index of the city: " + what + "; run map_city with --resume");
}

}  // namespace

RegionFiles::RegionFiles(const std::string& path) : path_(path) {
  std::error_code unknown;
  const std::filesystem::path as_path(path);
  if (as_path.filename().empty()) {  // a slash at the end: a folder
    path_ = as_path.parent_path().string();
  } else if (as_path.filename() == "index.json") {
    path_ = as_path.parent_path().empty() ? "." : as_path.parent_path().string();
  } else if (!std::filesystem::is_directory(path, unknown)) {
    is_map_file_ = true;
    open_.emplace_back(0, MapFile(path_, MapFile::Access::kRead));
    learn(open_.back().second);
    opened_.insert(0);
    return;
  }
  index_ = readCityIndex((std::filesystem::path(path_) / "index.json").string());
  for (std::size_t n = 0; n < index_.regions.size(); ++n) {
    const CityRegion& region = index_.regions[n];
    numbers_.emplace(std::make_pair(region.x, region.y), n);
    tiles_ += region.tiles;
  }
}

std::string RegionFiles::nameOf(std::size_t number) const {
  return is_map_file_ ? path_ : (std::filesystem::path(path_) / index_.regions[number].file).string();
}

std::pair<GridIndex, GridIndex> RegionFiles::cornersOf(std::size_t number) const {
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max() / 2;
  if (is_map_file_) return {{-kMost, -kMost, -kMost}, {kMost, kMost, kMost}};
  const std::int32_t edge = index_.region_tiles;
  const CityRegion& region = index_.regions[number];
  return {{region.x * edge, region.y * edge, -kMost},
          {region.x * edge + edge - 1, region.y * edge + edge - 1, kMost}};
}

std::optional<std::size_t> RegionFiles::regionOf(const GridIndex& tile) const {
  if (is_map_file_) return 0;
  const auto region =
      numbers_.find({floorDivide(tile.x, index_.region_tiles), floorDivide(tile.y, index_.region_tiles)});
  if (region == numbers_.end()) return std::nullopt;
  return region->second;
}

MapFile& RegionFiles::file(std::size_t number) {
  const auto known =
      std::find_if(open_.begin(), open_.end(), [&](const auto& each) { return each.first == number; });
  if (known != open_.end()) {
    open_.splice(open_.begin(), open_, known);
    return open_.front().second;
  }
  MapFile file = openRegion(number);
  if (!info_) learn(file);
  if (open_.size() >= kMostOpen) open_.pop_back();
  open_.emplace_front(number, std::move(file));
  opened_.insert(number);
  return open_.front().second;
}

MapFile RegionFiles::openRegion(std::size_t number) const {
  const std::string name = nameOf(number);
  std::error_code unknown;
  if (!std::filesystem::exists(name, unknown)) {
    throw MapFileError(name +
                       " is missing, although the index of the city lists it; run map_city with "
                       "--resume, or open the city again if it has just been changed");
  }
  MapFile file(name, MapFile::Access::kRead);
  checkTiles(file, number);
  for (const DriveRecord& drive : file.drives()) {
    if (index_.pieces.count(drive.id) == 0) {
      throwDiffers(name, "it holds drive '" + drive.id + "', which the index does not list");
    }
  }
  if (index_.resolution && *index_.resolution != file.info().resolution) {
    throwDiffers(name, "its resolution is " + numberText(file.info().resolution) + " m, not " +
                           numberText(*index_.resolution) + " m");
  }
  if (info_) checkSame(file);
  return file;
}

void RegionFiles::checkTiles(MapFile& file, std::size_t number) const {
  const CityRegion& region = index_.regions[number];
  const auto [low, high] = cornersOf(number);
  std::uint64_t blocks = 0;
  const std::vector<TileEntry> entries = file.tiles();
  for (const TileEntry& entry : entries) {
    blocks += static_cast<std::uint64_t>(entry.blocks);
    const GridIndex& t = entry.index;
    if (t.x < low.x || t.x > high.x || t.y < low.y || t.y > high.y) {
      throwDiffers(file.path(), "a tile lies in another region");
    }
  }
  if (entries.size() != region.tiles || blocks != region.blocks) {
    throwDiffers(file.path(), "it has " + std::to_string(entries.size()) + " tiles with " +
                                  std::to_string(blocks) + " blocks, not " + std::to_string(region.tiles) +
                                  " with " + std::to_string(region.blocks));
  }
}

void RegionFiles::checkSame(const MapFile& file) const {
  if (file.info().frame != info_->frame) {
    throw MapFileError(file.path() + " is in frame '" + file.info().frame + "', and " + info_path_ +
                       " in frame '" + info_->frame + "'; map the city again");
  }
  try {
    checkSameGrid(file.path(), file.info(), info_path_, *info_);
  } catch (const std::invalid_argument& difference) {
    throw MapFileError(difference.what());
  }
}

void RegionFiles::learn(MapFile& file) {
  info_ = file.info();
  info_path_ = file.path();
  if (is_map_file_) {
    tiles_ = file.tiles().size();
    for (const DriveRecord& drive : file.drives()) index_.pieces.insert(drive.id);
  }
}

const MapInfo& RegionFiles::info() {
  std::optional<MapFileError> first;
  for (std::size_t n = 0; n < count() && !info_; ++n) {
    try {
      file(n);
    } catch (const MapFileError& error) {
      if (!first) first = error;
    }
  }
  if (!info_) throw *first;
  return *info_;
}

double RegionFiles::resolution() {
  return index_.resolution ? *index_.resolution : info().resolution;
}

}  // namespace bki_mapping
