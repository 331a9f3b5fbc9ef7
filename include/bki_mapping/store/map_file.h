/// @file Map files (.bkm): maps on disk, read and written tile by tile. docs/map_file.md specifies the
/// format.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/store/scan_record.h"

namespace bki_mapping {

/// A map file cannot be read or written: one sentence with the file, the fault and the remedy.
class MapFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// The content of a map file is not what was written.
class MapFileDamaged : public MapFileError {
 public:
  using MapFileError::MapFileError;
};
/// A change whose MapFile::Change::commit() reported a failure has reached the file completely after all. It
/// must not be repeated.
class MapFileLateCommit : public MapFileError {
 public:
  using MapFileError::MapFileError;
};
/// The file is open elsewhere, in another process or in this one.
class MapFileInUse : public MapFileError {
 public:
  using MapFileError::MapFileError;
};

/// The error for a file that should have a journal, and is of an older version.
MapFileError withoutJournal(const std::string& path);

/// A unit of evidence is 2^-kUnitExponent.
constexpr int kUnitExponent = 16;
static_assert(kEvidenceUnit * (1 << kUnitExponent) == 1.0f);

/// What all tiles of a map file have in common; fixed when the file is created.
struct MapInfo {
  double resolution = 0.0;  ///< edge of a voxel [m], > 0
  double prior = 0.0;       ///< alpha0, concentration of each class before any scan, > 0
  int unit_exponent = kUnitExponent;
  std::string frame;                          ///< name of the map frame
  std::shared_ptr<const ClassTable> classes;  ///< never nullptr
  std::string parameters;  ///< the mapper's settings, for people and for resuming; YAML, at most 1 MB
  /// Name and version of the program that created the file; set by the library.
  std::string program;

  /// An empty map with this resolution, prior and number of classes, and without gains.
  SemanticMap emptyMap() const;
};

/// A drive whose scans are in a map.
struct DriveRecord {
  std::string id;    ///< identifies the drive in every map that contains it; not empty, at most 1 MB
  std::string name;  ///< for people
  /// 0: the file holds the drive's evidence only in the sum of all drives. > 0: the number of the part that
  /// also stores it separately; drives with the same number share a part.
  int part = 0;
  std::uint64_t scans = 0;
  std::uint64_t first_stamp = 0, last_stamp = 0;  ///< of the scans [ns], below 2^63
  Eigen::AlignedBox3d bounds;  ///< bounding box of the blocks that it touched, map frame [m]; may be empty

  bool operator==(const DriveRecord& other) const;

  /// Counts a scan. @param stamp of the scan [ns]. @param touched the blocks that it touched.
  void addScan(std::uint64_t stamp, const GridGeometry& geometry, const std::vector<GridIndex>& touched);
  /// Extends the bounds by blocks that its scans touch after they have moved.
  void addTouched(const GridGeometry& geometry, const std::vector<GridIndex>& touched);
};

/// Names a tile of 8 x 8 x 8 blocks: its index, as Region::regionOf gives it, and the part of the file that
/// holds it. Part 0 is the map, the sum of all drives. Each other part holds the evidence of a single drive,
/// or the sum of several (DriveRecord::part).
struct TileKey {
  GridIndex index;
  int part = 0;
};

/// A row of the list of tiles.
struct TileEntry {
  GridIndex index;
  int blocks = 0;              ///< 1 to 512
  int planes = 0;              ///< of all blocks together
  std::uint32_t checksum = 0;  ///< of the content; equal content has equal checksums

  bool operator==(const TileEntry& o) const {
    return index == o.index && blocks == o.blocks && planes == o.planes && checksum == o.checksum;
  }
};

/// An open map file. Either one object updates a file, or any number of them read it; the constructor refuses
/// other combinations. The lock is released when the process ends, even if it is killed. Committed changes
/// survive a killed process and a power failure; other changes are undone.
///
/// Not thread-safe, but may move between threads. Each function throws MapFileError if the file cannot be
/// read or written, is damaged, or is not a map file. A failed call changes nothing.
class MapFile {
 public:
  enum class Access { kRead, kUpdate };

  /// Opens a file and checks all of it except the content of the tiles. If a process was killed in the middle
  /// of a change, the change is undone first.
  MapFile(const std::string& path, Access access);
  /// Creates a file without tiles or drives, and opens it for update.
  /// @throws MapFileError if the file exists already, std::invalid_argument if the info is invalid.
  static MapFile create(const std::string& path, const MapInfo& info);
  ~MapFile();
  MapFile(MapFile&&) noexcept;
  MapFile& operator=(MapFile&&) noexcept;

  const std::string& path() const;
  const MapInfo& info() const;
  /// The size of all parts together.
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
  /// The tiles from `low` to `high`, both included. The cost grows with the number of tiles between them in
  /// z.
  std::vector<TileEntry> tilesIn(const GridIndex& low, const GridIndex& high, int part = 0);
  std::optional<TileEntry> findTile(const TileKey& key);

  /// Adds a stored tile to a map, as SemanticMap::add does. Where the map has no block, it gets an exact copy
  /// of the stored one. @return false if the file has no such tile; the map is then unchanged.
  /// @throws std::invalid_argument if resolution, prior or number of classes of the map differ.
  /// @throws std::bad_alloc; the map may then lack some blocks of the tile.
  bool addTileTo(SemanticMap& map, const TileKey& key);

  // The journal: the scans in the map that can be moved to other poses. Not every scan has to be in it.
  /// Whether the file's version has a journal.
  bool hasJournal() const;
  JournalSize journalSize();
  /// Sorted by number.
  std::vector<ScanRecord> scans();
  /// The points of a scan of the journal, packed as docs/map_file.md says.
  std::string scanContent(std::uint64_t number);
  /// The parameters with which scans of the journal were integrated, as YAML, by number.
  std::vector<std::string> settings();
  /// Boxes of the map that were cleared, in order (map frame [m]).
  std::vector<Eigen::AlignedBox3d> clearedBoxes();

  /// A change of the file. commit() makes it durable as a whole; without it, the change is undone. The file
  /// must outlive the change, and can have only one change at a time. Do not commit a change one of whose
  /// functions has thrown: it may lack the tile or drive that was to be replaced.
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

    // The journal; these throw MapFileError if the file's version has none.
    /// Adds a scan with a number that the journal does not have. @param content its packed points.
    /// @throws std::invalid_argument if the record is invalid.
    void addScan(const ScanRecord& scan, const std::string& content);
    /// Replaces all of a scan but its content. @throws std::invalid_argument likewise.
    void moveScan(const ScanRecord& scan);
    /// Adds settings, as YAML. @return their number.
    int addSettings(const std::string& parameters);
    /// Notes that a box is being cleared; the caller clears it. @return the number of boxes now.
    int addClearedBox(const Eigen::AlignedBox3d& box);
    /// Forgets all scans, settings and boxes; the map stays as it is. Does nothing if the version has none.
    void eraseJournal();
    /// Whether the change can still be made: after an error of the disk, also of reading, it may be undone.
    bool isOpen() const;
    /// Writes the change to the disk, and returns when it is durable. The object must not be used afterwards.
    /// If the function throws, the change is not made; MapFile::change() describes the one exception.
    void commit();

   private:
    friend class MapFile;
    struct State;
    explicit Change(MapFile& file);
    void requireJournal() const;
    std::unique_ptr<State> state_;
  };
  /// Begins a change. @throws std::logic_error if the file is open for reading only.
  /// @throws MapFileLateCommit, once, if the last commit() threw an error at its very end, but the change has
  /// reached the disk.
  Change change();

 private:
  struct State;
  friend class NewMapFile;
  explicit MapFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// A map file that is being written. It replaces the file at `path` as a whole when commit() is called, as
/// AtomicFile does. Until then an existing map at `path` is locked.
class NewMapFile {
 public:
  /// @param info without MapInfo::program, which the library sets.
  /// @param replaced the map at `path`, if the caller has it open for update; it must not be used after
  /// commit(). @throws MapFileError if the file cannot be written, MapFileInUse if it is open elsewhere,
  /// std::invalid_argument if the info is invalid.
  NewMapFile(const std::string& path, const MapInfo& info, const MapFile* replaced = nullptr);
  ~NewMapFile();

  /// The change that fills the file. Call NewMapFile::commit() instead of the commit() of the change.
  MapFile::Change& content();
  /// Replaces the file at `path`, and returns when the new one is on the disk. The object must not be used
  /// afterwards. @throws MapFileError.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A whole map in memory: the sum of all drives, without the parts of single drives.
struct StoredMap {
  MapInfo info;
  std::vector<DriveRecord> drives;  ///< their part is 0
  SemanticMap map;
};

/// Writes a map to a file, as NewMapFile does.
/// @param info without resolution and prior, which come from the map. @param drives are written with part 0.
/// @throws as NewMapFile; std::invalid_argument if a drive is invalid.
void saveMap(const std::string& path, const MapInfo& info, const std::vector<DriveRecord>& drives,
             const SemanticMap& map);

/// Copies a map file with all its parts, as NewMapFile does. @throws MapFileError, and as NewMapFile.
void copyMap(MapFile& file, const std::string& path);

/// Adds the journal of a file to another, which has none. @throws MapFileError.
void copyJournal(MapFile& file, MapFile::Change& copy);

/// Reads a whole map (part 0) and checks every byte of it.
/// @param memory_limit for the map [bytes]; 0: no limit. @throws MapFileError, also if the map would exceed
/// the limit, and then before its memory is allocated (that of looks: when a tile has been read);
/// std::bad_alloc.
StoredMap loadMap(const std::string& path, std::size_t memory_limit = 0);
/// The same of an open file.
StoredMap readMap(MapFile& file, std::size_t memory_limit = 0);

/// Checks that two maps can be added: they must have the same resolution, unit and prior, and classes with
/// the same ids and names. Colours and flags of classes may differ.
/// @param name, other_name names of the two maps for the error, such as their files.
/// @throws std::invalid_argument in one sentence with both values of the first difference.
void checkSameGrid(const std::string& name, const MapInfo& info, const std::string& other_name,
                   const MapInfo& other);

/// Checks that another map can be added to the map in a file: they must have the same frame and grid.
/// @param own describes the other map; an empty frame matches every frame.
/// @throws MapFileError in one sentence with the file and both values.
void checkFits(const MapFile& file, const MapInfo& own);

/// The memory of a tile in a map, without the map's index and the looks, of which the list of tiles says
/// nothing [bytes].
std::size_t memoryOf(const TileEntry& tile);
/// The memory of the looks that a map has in a tile [bytes].
std::size_t memoryOfLooks(const SemanticMap& map, const GridIndex& tile);

/// The tiles in which a map has blocks, sorted by index.
std::vector<GridIndex> tilesOf(const SemanticMap& map);

/// The number of blocks and tiles, in the sum of all drives, that were changed or erased.
struct ClearedFile {
  std::uint64_t blocks = 0, tiles = 0;
};

/// Does to a map file what clearBox() does to a map, both to the sum of all drives and to the parts of single
/// drives. Drives without evidence left stay in the list of drives.
/// @param output file for the result, written by NewMapFile. If it is "" or the same file, the file itself is
/// changed, completely or not at all; it does not shrink, but later evidence reuses the free space.
/// @throws MapFileError if a file cannot be read or written, or is in use; std::invalid_argument if a corner
/// of the box is not a number.
ClearedFile clearBoxOfFile(const std::string& path, const Eigen::AlignedBox3d& box,
                           const std::string& output = "");

}  // namespace bki_mapping
