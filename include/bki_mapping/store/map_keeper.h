/// @file Keeps the map of a mapper in a map file while scans come in.
#pragma once

#include <cstdint>
#include <future>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Holds the tiles of a map near the sensor in the memory of a mapper, and the others in a map file. The map
/// is the sum of both, to the bit the one that a mapper without a window would have: a scan adds evidence
/// wherever it reaches, and what the file has there is added when it arrives, or when the tile leaves. So no
/// scan waits for the disk, which has a thread of its own. (Not so for free_space/extent `mapped` and
/// occlusion marks, which depend on what is in memory when a scan comes.)
///
/// What was saved stays, whatever happens to the process or the power. If the file cannot be written, tiles
/// stay in memory, and writing is tried again.
///
/// Not thread-safe; for the thread of the mapper. Functions return at once unless they say otherwise.
class MapKeeper {
 public:
  /// What should be in memory: the tiles within a cube.
  struct Window {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();       ///< map frame [m]
    double edge = std::numeric_limits<double>::infinity();  ///< [m]
  };

  /// Opens a map file, or creates it. @param mapper with an empty map; must outlive this object, and be
  /// changed only as the functions here say. @param info what the mapper maps. @param drive that begins.
  /// @throws MapFileError if the file cannot be opened or its map has another grid or frame (checkFits);
  /// std::invalid_argument if it holds a drive with this id already; std::logic_error if the map is not
  /// empty.
  MapKeeper(SemanticMapper& mapper, const std::string& path, const MapInfo& info, const DriveRecord& drive);
  /// As close().
  ~MapKeeper();

  /// Notes what the last SemanticMapper::integrate has changed. @param stamp of the scan [ns].
  void addScan(std::uint64_t stamp);
  /// Adds to the map what has arrived from the file, asks for tiles that have come into the window, and gives
  /// away tiles that have left it. With MapperConfig::memory_limit, the window shrinks as far as necessary.
  /// To be called often, also when no scans come. @return the blocks that arrived or left.
  std::vector<GridIndex> moveTo(const Window& window);
  /// Gives away as many tiles as it can when the mapper has refused a scan for lack of memory.
  /// @return whether memory was gained; the next moveTo() returns the blocks that left.
  bool makeRoom();
  /// Waits until all that was asked for is in memory, or the file cannot be read.
  /// @return the blocks that arrived.
  std::vector<GridIndex> waitForTiles();

  /// Writes what has changed, and the drive. @return ready when all of the map is in the file and durable.
  /// Not ready as long as fault() says why.
  std::future<void> save();
  /// Writes the whole map to another file. @return ready when it is complete, or with a MapFileError.
  std::future<void> saveTo(const std::string& path);
  /// Clears the map, in memory and in the file. @param drive that begins.
  void reset(const DriveRecord& drive);
  /// Adds another map, in memory or in the file. @throws std::invalid_argument if one of its drives is in
  /// this map already, or as SemanticMap::add; nothing is then added. std::bad_alloc.
  void addMap(SemanticMap other, const std::vector<DriveRecord>& drives);

  /// Clears a box, in memory and in the file. @param box map frame [m]; may be infinite.
  /// @return the blocks in memory that changed.
  std::vector<GridIndex> clearBox(const Eigen::AlignedBox3d& box);

  /// What is wrong with the file at present: one sentence; "" if nothing is.
  std::string fault() const;
  /// Memory of tiles that left and are not yet in the file [bytes].
  std::size_t waitingBytes() const;
  const std::string& path() const;

  /// Saves, and closes the file; waits for that. The map in memory stays. @return what was lost and why; ""
  /// if nothing was.
  std::string close();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace bki_mapping
