/// @file Maps on disk of which programs read a part: map files, and the cities of map_city.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "bki_mapping/store/mapper_file.h"

namespace bki_mapping {

/// A region of a city: a square column of tiles of every height, in a map file of its own.
struct CityRegion {
  std::int32_t x = 0, y = 0;  ///< its first tile is (x, y) times the edge of a region
  std::string file;           ///< below the folder of the city
  std::uint64_t tiles = 0, blocks = 0;
  std::uint64_t bytes = 0;  ///< of the file
  Eigen::AlignedBox3d
      bounds;  ///< of the voxels that are free, occupied or occluded, map frame [m]; may be empty
};

/// A map on disk: a map file (.bkm), or a city, which is a folder that map_city wrote. Reads only the tiles
/// that are asked for, and of a city only the files of the regions that these are in. What it reads equals,
/// to the bit, the same part of the whole map.
///
/// Not thread-safe, but may move between threads. Functions throw MapFileError if a file cannot be read, is
/// damaged, or does not fit the index of the city or its other regions.
class TiledMap {
 public:
  /// The memory that programs allow for what they read, unless the user sets another limit [bytes].
  static constexpr std::size_t kUsualLimit = 4'000'000'000;

  /// Opens a map. Of a city, only the index is read.
  /// @param path of a map file, or of the folder of a city or its index.json.
  explicit TiledMap(const std::string& path);
  ~TiledMap();
  TiledMap(TiledMap&&) noexcept;
  TiledMap& operator=(TiledMap&&) noexcept;

  /// Of the map file, or of the folder of the city.
  const std::string& path() const;
  bool isCity() const;
  /// Sorted by x, then y; of a map file none.
  const std::vector<CityRegion>& regions() const;
  /// The edge of a region [tiles]; of a map file 0.
  std::int32_t regionTiles() const;
  /// The names of the drives in the index of a city, sorted; of a map file none.
  const std::vector<std::string>& driveNames() const;
  /// The ids (DriveRecord::id) of the drives in the map; in a city they are pieces of drives.
  const std::set<std::string>& driveIds() const;
  /// The number of tiles in the whole map, and of the files that hold them.
  std::uint64_t tileCount() const;
  std::size_t fileCount() const;
  /// What all tiles have in common. Of a city, the parameters are those of the region that was opened first;
  /// if none was opened yet, this opens one.
  const MapInfo& info();
  /// The edge of a voxel [m]. Opens no region if the index says it.
  double resolution();
  /// The map file, or nullptr for a city.
  MapFile* file();

  /// Reads the voxels whose centres lie in a box; all others are unknown. The rules are those of storedRules.
  /// @param box map frame [m], faces included; may be infinite. @param memory_limit for the map [bytes]; 0:
  /// no limit. @throws MapFileError also if the tiles take more memory, and then before it is allocated;
  /// std::invalid_argument if a corner of the box is not a number.
  /// @return DriveRecord::part is as in the file; of a city, the drives are those of the regions that the box
  /// touches.
  RuledMap readBox(const Eigen::AlignedBox3d& box, std::size_t memory_limit = 0);
  /// Reads whole tiles; those that the map lacks stay unknown. @throws as readBox.
  RuledMap readTiles(const std::vector<GridIndex>& tiles, std::size_t memory_limit = 0);
  /// Reads the tiles that contain points. @param points map frame [m]; those beyond the grid are skipped.
  /// @throws as readBox; std::invalid_argument if a coordinate is not finite.
  RuledMap readTilesAt(const std::vector<Eigen::Vector3d>& points, std::size_t memory_limit = 0);
  /// The tiles with voxels in a box that the map has, sorted by file. Reads no content of tiles.
  std::vector<TileEntry> tilesIn(const Eigen::AlignedBox3d& box);
  /// The files that may have tiles of a box, as positions in regions(); 0 for a map file. Opens none of them.
  std::vector<std::size_t> filesIn(const Eigen::AlignedBox3d& box);
  /// The tiles with voxels in a box that one of these files has.
  std::vector<TileEntry> tilesIn(const Eigen::AlignedBox3d& box, std::size_t file);

  /// What has been read since the map was opened.
  struct Reading {
    std::size_t files = 0;    ///< that were opened, each counted once
    std::uint64_t tiles = 0;  ///< whose content was read, each as often as it was read
  };
  Reading reading() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The folder of the city that a path lies in or names, whether or not the file exists; "" if there is none.
/// Programs other than map_city must not write there.
std::string cityAround(const std::string& path);

}  // namespace bki_mapping
