/// @file Keeps the map of a mapper in a map file while scans come in.
#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Holds the tiles of a map near the sensor in the memory of a mapper, and the other tiles in a map file. The
/// map is the sum of both, and equals, to the bit, the map that a mapper without a window would make. No scan
/// waits for the disk, which has a thread of its own: a scan adds its evidence to a fresh tile, and the
/// evidence in the file is added when it has been read, or when the tile leaves memory. (Two things depend on
/// what is in memory when a scan arrives, and so on the window: free_space/extent `mapped`, and occlusion
/// marks.)
///
/// What was saved survives a killed process and a power failure. If the file cannot be written, tiles stay in
/// memory, and the keeper tries again.
///
/// Not thread-safe; for the thread of the mapper. Functions return at once unless they say otherwise.
class MapKeeper {
 public:
  /// A cube whose tiles should be in memory.
  struct Window {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();       ///< map frame [m]
    double edge = std::numeric_limits<double>::infinity();  ///< [m]
  };

  /// Opens a map file, or creates it. @param mapper with an empty map; must outlive this object. While this
  /// object exists, only SemanticMapper::integrate and the functions below may change the map.
  /// @param info describes the mapper's map. @param drive the drive that begins.
  /// @param journal whether scans are kept in the file's journal (keepJournal).
  /// @throws MapFileError if the file cannot be opened, its map has another grid or frame (checkFits), or it
  /// is of a version without a journal; std::invalid_argument if it already holds a drive with this id;
  /// std::logic_error if the map is not empty.
  MapKeeper(SemanticMapper& mapper, const std::string& path, const MapInfo& info, const DriveRecord& drive,
            bool journal = false);
  /// Does what close() does.
  ~MapKeeper();

  /// Notes what the last SemanticMapper::integrate has changed. @param stamp of the scan [ns].
  void addScan(std::uint64_t stamp);
  /// Adds tiles that have been read from the file to the map, requests tiles that have come into the window,
  /// and hands over to the file tiles that have left it. With MapperConfig::memory_limit, the window shrinks
  /// as far as necessary. Call it often, even when no scans arrive.
  /// @return the blocks that were added or removed.
  std::vector<GridIndex> moveTo(const Window& window);
  /// Hands over as many tiles as possible to the file after the mapper has refused a scan for lack of memory.
  /// @return whether memory was gained; the next moveTo() returns the blocks that were removed.
  bool makeRoom();
  /// Waits until all requested tiles are in memory, or the file cannot be read.
  /// @return the blocks that were added.
  std::vector<GridIndex> waitForTiles();

  /// Sets what tells how the journal has changed since the last call; it is asked for whenever the map is
  /// saved. The file then holds each scan of the journal exactly once, at its pose in the journal, also if
  /// the process is killed: evidence becomes durable only with a save.
  void keepJournal(std::function<JournalChange()> take);
  /// The journal of the file when it was opened, or after a reset().
  const JournalSize& journalSize() const;
  /// Saves the map, and forgets the journal of the file: all scans stay where they are.
  void forgetJournal();
  /// Reads the packed points of a scan of the journal, and returns when that is done. May be called in any
  /// thread while this object exists. @throws MapFileError.
  std::string scanContent(std::uint64_t number);
  /// With a journal, whether so much waits for a save that one should come soon.
  bool wantsSave() const;
  /// Writes the drive and all changes of the map. @return becomes ready when the whole map is durable in the
  /// file; it does not while the file cannot be written (fault()).
  std::future<void> save();
  /// Writes the whole map to another file. @return becomes ready when that file is complete, or throws a
  /// MapFileError.
  std::future<void> saveTo(const std::string& path);
  /// Clears the map, in memory and in the file. @param drive the drive that begins.
  void reset(const DriveRecord& drive);
  /// Adds another map, in memory or in the file. @throws std::invalid_argument if this map already contains
  /// one of the drives, or as SemanticMap::add; nothing is then added. @throws std::bad_alloc.
  /// @param allow_overlap adds drives that share scans with those of this map according to their ids, too.
  void addMap(SemanticMap other, const std::vector<DriveRecord>& drives, bool allow_overlap = false);

  /// Clears a box, in memory and in the file. @param box map frame [m]; may be infinite.
  /// @return the blocks in memory that changed.
  std::vector<GridIndex> clearBox(const Eigen::AlignedBox3d& box);

  /// Adds the difference that a move of scans makes, which may hold negative evidence: in memory, or in the
  /// file where it has tiles that are not in memory. What there is no memory for is added later.
  /// @throws std::invalid_argument as SemanticMap::add.
  void change(SemanticMap difference);
  /// Replaces the looks of a tile, in memory and in the file (bki_mapping::replaceLooks).
  /// @return the blocks in memory that changed.
  std::vector<GridIndex> replaceLooks(const GridIndex& tile, const LooksByBlock& looks);

  /// The tiles in the file, once all changes are written, sorted.
  std::vector<GridIndex> storedTiles() const;

  /// What is wrong with the file at the moment, in one sentence; "" if nothing is.
  std::string fault() const;
  /// Memory of the tiles that have left the map and are not yet in the file [bytes].
  std::size_t waitingBytes() const;
  const std::string& path() const;

  /// Saves, closes the file, and returns when that is done. The map stays in memory. @return what was lost,
  /// and why; "" if nothing was.
  std::string close();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace bki_mapping
