/// @file A map file on a thread of its own, so that nobody waits for the disk.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Reads and changes a map file in the order of the calls. Changes become durable together with what was
/// called before them; what fails, as on a full disk, is tried again until it succeeds. All functions return
/// at once, and are for one thread.
class TileStore {
 public:
  /// Number of a call, 1 for the first one.
  using Call = std::uint64_t;
  /// Evidence that comes back, to be added to the map in memory.
  struct Arrival {
    enum class Kind {
      kLoaded,   ///< what the file has in the tile; nothing if it has no such tile
      kDamaged,  ///< the tile in the file cannot be read, and stays there as it is: nothing
      kReturned  ///< likewise: what was to be added to it
    };
    Kind kind;
    GridIndex tile;
    SemanticMap map;
    Call call;  ///< whose answer this is
  };

  /// @param retry time between two trials of what fails.
  explicit TileStore(MapFile file, std::chrono::milliseconds retry = std::chrono::seconds(1));
  /// As close().
  ~TileStore();

  /// Asks for a tile.
  Call load(const GridIndex& tile);
  /// Replaces a tile in the file. @param map as in MapFile::Change::writeTile.
  void replace(const GridIndex& tile, SemanticMap map);
  /// Adds to a tile in the file. If that is damaged, the evidence arrives again.
  void add(const GridIndex& tile, SemanticMap map);

  /// Replaces tiles in the file by copies of those in memory, and writes the drive. @return ready when this
  /// and all that was called before is durable.
  std::future<void> save(SemanticMap snapshot, std::vector<GridIndex> tiles, const DriveRecord& drive);
  /// Empties the file.
  Call clear();
  /// Changes the tiles of the file. @param change adds to, or takes from, a map with one tile.
  void changeTiles(std::vector<GridIndex> tiles, std::function<void(SemanticMap&)> change);
  void putDrive(const DriveRecord& drive);
  /// Copies the file. @return ready when the copy is complete, or with the error.
  std::future<void> copyTo(const std::string& path);

  /// What has arrived, in the order of the calls.
  std::vector<Arrival> takeArrivals();
  /// Waits until all that was called has been tried.
  void waitForTrial();
  /// Why changes fail at present; "" if they do not.
  std::string fault() const;
  /// Memory of what is not yet durable [bytes].
  std::size_t waitingBytes() const;

  /// Tries what is left once more, and ends the thread. @return what was lost and why; "" if nothing was.
  std::string close();

 private:
  /// @return whether it must be done again if the change fails.
  using Work = std::function<bool(MapFile& file, MapFile::Change& change, Call call)>;
  struct Job {
    Work work;
    std::size_t bytes = 0;
    std::optional<std::promise<void>> durable = std::nullopt;
    bool first = false;  ///< what was called before must be durable: it asks the file for its drives
    bool done = false;
  };

  Call enqueue(Job job);
  void run();
  /// Tries the first jobs, as one change. @return whether they are durable.
  bool tryJobs(std::unique_lock<std::mutex>& lock);
  void arrive(Arrival arrival);

  std::optional<MapFile> file_;  ///< until close()
  const std::chrono::milliseconds retry_;

  mutable std::mutex mutex_;
  std::condition_variable wake_, tried_;
  std::deque<Job> jobs_;
  std::vector<Arrival> arrivals_;
  std::string fault_;
  std::size_t waiting_bytes_ = 0;
  Call called_ = 0, ended_ = 0;
  std::size_t last_trial_ = 0;  ///< number of jobs in the last trial that failed
  std::size_t failures_ = 0;    ///< number of trials that failed
  bool closing_ = false;
  std::thread thread_;  ///< last, so that it starts when all else is there
};

}  // namespace bki_mapping
