/// @file Map files (.bkm): maps on disk, read and written tile by tile. docs/map_file.md specifies the
/// format.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/store/map_info.h"

namespace bki_mapping {

/// The tile of 8 x 8 x 8 blocks with an index, as Region::regionOf gives it, in one part of the file.
/// Part 0 is the map, the sum of all drives. Each of the other parts holds the evidence of one drive alone,
/// or of several that cannot be told apart (DriveRecord::part).
struct TileKey {
  GridIndex index;
  int part = 0;
};

/// What the list of tiles says of one.
struct TileEntry {
  GridIndex index;
  int blocks = 0;              ///< 1 to 512
  int planes = 0;              ///< of all blocks together
  std::uint32_t checksum = 0;  ///< of the content; equal content has equal checksums

  bool operator==(const TileEntry& o) const {
    return index == o.index && blocks == o.blocks && planes == o.planes && checksum == o.checksum;
  }
};

/// An open map file. Many may read a file, or one may update it: who comes second is refused. The lock goes
/// with the process, however that ends. What was committed stays, whatever happens to the process or the
/// power; what was not is gone.
///
/// Not thread-safe, but may move between threads. Each function throws MapFileError if the file cannot be
/// read or written, is damaged, or is no map file. A failed call changes nothing.
class MapFile {
 public:
  enum class Access { kRead, kUpdate };

  /// Opens a file and checks all of it but the content of the tiles. A file that a killed process left in
  /// the middle of a change is restored to the state before it.
  MapFile(const std::string& path, Access access);
  /// Creates a file without tiles or drives, and opens it for update.
  /// @throws MapFileError if there is such a file already, std::invalid_argument if the info is invalid.
  static MapFile create(const std::string& path, const MapInfo& info);
  ~MapFile();
  MapFile(MapFile&&) noexcept;
  MapFile& operator=(MapFile&&) noexcept;

  const std::string& path() const;
  const MapInfo& info() const;
  /// Of all parts together.
  struct Size {
    std::uint64_t tiles, blocks, planes;
    std::uint64_t bytes;  ///< of the file
  };
  Size size() const;
  /// Sorted by id.
  std::vector<DriveRecord> drives();
  /// The parts that have tiles, sorted.
  std::vector<int> parts();
  /// All tiles of a part, sorted by index (z, then y, then x). Reads no content.
  std::vector<TileEntry> tiles(int part = 0);
  /// The tiles from `low` to `high`, both included. The cost grows with the tiles in the range along z.
  std::vector<TileEntry> tilesIn(const GridIndex& low, const GridIndex& high, int part = 0);
  std::optional<TileEntry> findTile(const TileKey& key);

  /// Adds a stored tile to a map, as SemanticMap::add does. Where the map has no block, it then holds the
  /// stored one to the bit. @return false if the file has no such tile; the map is then unchanged.
  /// @throws std::invalid_argument if resolution, prior or number of classes of the map differ,
  /// std::bad_alloc; blocks of the tile may then be missing in the map.
  bool addTileTo(SemanticMap& map, const TileKey& key);

  /// A change of the file: becomes durable as a whole by commit(), or not at all. The file must outlive it,
  /// and have only one at a time.
  class Change {
   public:
    ~Change();
    Change(Change&&) noexcept;

    /// Replaces a tile by the blocks that a map has there; erases it if there are none. Blocks without
    /// evidence and occlusion marks are left out. @throws std::invalid_argument as addTileTo().
    void writeTile(const SemanticMap& map, const TileKey& key);
    void eraseTile(const TileKey& key);
    /// Adds a drive, or replaces the one with the same id.
    /// @throws std::invalid_argument if the record is invalid.
    void putDrive(const DriveRecord& drive);
    void eraseDrive(const std::string& id);
    /// Returns when the change is on the disk. The object must not be used after it.
    /// If it throws, the change is not made; see MapFile::change() for the one exception.
    void commit();

   private:
    friend class MapFile;
    struct State;
    explicit Change(MapFile& file);
    std::unique_ptr<State> state_;
  };
  /// @throws std::logic_error if the file is open for reading; MapFileLateCommit, once, if the disk failed at
  /// the very end of the last commit(), which then threw another error.
  Change change();

 private:
  struct State;
  friend class NewMapFile;
  explicit MapFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// A map file in the making. It replaces what `path` holds when commit() returns, and nothing before
/// (AtomicFile). A map that is there is locked for others until then.
class NewMapFile {
 public:
  /// @param info MapInfo::program is set by the library.
  /// @param replaced the map at `path`, if it is open for update here; it must not be used after commit().
  /// @throws MapFileError if the file cannot be written, MapFileInUse if it is open in another place,
  /// std::invalid_argument if the info is invalid.
  NewMapFile(const std::string& path, const MapInfo& info, const MapFile* replaced = nullptr);
  ~NewMapFile();

  /// What to write into the file. Its commit() must not be called.
  MapFile::Change& content();
  /// Returns when the file is on the disk. The object must not be used after it. @throws MapFileError.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A whole map in memory: the sum of all drives, without the parts of single ones.
struct StoredMap {
  MapInfo info;
  std::vector<DriveRecord> drives;  ///< all of part 0
  SemanticMap map;
};

/// Writes a map to a file by NewMapFile.
/// @param info resolution and prior are taken from the map. @param drives their parts are set to 0.
/// @throws as NewMapFile, and std::invalid_argument if a drive is invalid.
void saveMap(const std::string& path, const MapInfo& info, const std::vector<DriveRecord>& drives,
             const SemanticMap& map);

/// Copies a map file, all parts of it, to another one by NewMapFile. @throws as NewMapFile, MapFileError.
void copyMap(MapFile& file, const std::string& path);

/// Reads a whole map (part 0) and checks every byte of it.
/// @param memory_limit for the map [bytes]; 0: none. @throws MapFileError, also if the map would exceed the
/// limit, then before its memory is taken; std::bad_alloc.
StoredMap loadMap(const std::string& path, std::size_t memory_limit = 0);
/// The same of an open file.
StoredMap readMap(MapFile& file, std::size_t memory_limit = 0);

/// Checks that what is mapped elsewhere can be added to the map in a file: same frame and same grid.
/// @param own what the other map is; without a frame, any is right.
/// @throws MapFileError in one sentence with the file and both values.
void checkFits(const MapFile& file, const MapInfo& own);

/// The tiles in which a map has blocks, sorted by index.
std::vector<GridIndex> tilesOf(const SemanticMap& map);

}  // namespace bki_mapping
