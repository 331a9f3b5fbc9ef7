/// @file The files of a city's regions, opened when they are asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "bki_mapping/city/tiled_map.h"
#include "bki_mapping/store/map_file.h"
#include "city/city_index.h"

namespace bki_mapping {

/// The map files of a city, each with the number of its region in the index. A map file by itself counts as
/// the only region, number 0, which has no bounds. Functions throw MapFileError as TiledMap's do.
class RegionFiles {
 public:
  /// @param path as for TiledMap.
  explicit RegionFiles(const std::string& path);

  /// Of the map file, or of the folder of the city.
  const std::string& path() const { return path_; }
  bool isMapFile() const { return is_map_file_; }
  /// Of a map file: only the ids of its drives, as pieces.
  const CityIndex& index() const { return index_; }
  std::size_t count() const { return is_map_file_ ? 1 : index_.regions.size(); }
  std::uint64_t tileCount() const { return tiles_; }
  /// The path of a file.
  std::string nameOf(std::size_t number) const;
  /// The corner tiles of a region, of every height.
  std::pair<GridIndex, GridIndex> cornersOf(std::size_t number) const;
  /// The region that holds a tile; none if the city lacks it.
  std::optional<std::size_t> regionOf(const GridIndex& tile) const;

  /// Opens a file, unless it is open, and checks that it is what the index says. The reference is valid until
  /// another file is opened, which info() and resolution() may do; that of a map file stays valid.
  MapFile& file(std::size_t number);
  /// Of the file that was opened first. If there is none, opens regions until one is sound.
  const MapInfo& info();
  /// The path of the file of info(). Call info() before.
  const std::string& infoPath() const { return info_path_; }
  /// The edge of a voxel [m]. Opens no file if the index says it.
  double resolution();
  /// How many files have been opened, each counted once.
  std::size_t openedCount() const { return opened_.size(); }

 private:
  MapFile openRegion(std::size_t number) const;
  void checkTiles(MapFile& file, std::size_t number) const;
  /// Checks that a file has the frame and the grid of that of info().
  void checkSame(const MapFile& file) const;
  void learn(MapFile& file);

  std::string path_;
  bool is_map_file_ = false;
  CityIndex index_;
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> numbers_;  ///< of the regions, by x and y
  std::uint64_t tiles_ = 0;
  std::list<std::pair<std::size_t, MapFile>> open_;  ///< by number, the last used first
  std::set<std::size_t> opened_;                     ///< numbers of all files that have been opened
  std::optional<MapInfo> info_;
  std::string info_path_;
};

}  // namespace bki_mapping
