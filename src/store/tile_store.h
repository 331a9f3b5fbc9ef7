/// @file A map file with a thread of its own, so that callers never wait for the disk.
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

/// Reads and changes a map file, in the order of the calls. A change becomes durable only after, or together
/// with, all earlier ones. A change that fails, for example because the disk is full, is tried again until it
/// succeeds. Functions return at once unless they say otherwise. Not thread-safe.
///
/// A file with a journal must hold each of its scans exactly once, whenever a process is killed. There a
/// change ends with save() or clear(): until then nothing of it becomes durable, and all of it takes memory.
class TileStore {
 public:
  /// Number of a call, 1 for the first one.
  using Call = std::uint64_t;
  /// The answer to a call: evidence for the map in memory.
  struct Arrival {
    enum class Kind {
      kLoaded,   ///< `map` is the tile in the file; empty if the file has no such tile
      kDamaged,  ///< the tile in the file cannot be read, and stays there as it is; `map` is empty
      kReturned  ///< the tile in the file cannot be read; `map` is the evidence that add() should have added
    };
    Kind kind;
    GridIndex tile;
    SemanticMap map;
    Call call;  ///< the call that this answers
  };

  /// @param journalled whether the file has a journal. @param retry time between two trials of a change that
  /// fails.
  explicit TileStore(MapFile file, bool journalled = false,
                     std::chrono::milliseconds retry = std::chrono::seconds(1));
  /// Does what close() does.
  ~TileStore();

  /// Requests a tile; it comes as an Arrival.
  Call load(const GridIndex& tile);
  /// Replaces a tile in the file. @param map as in MapFile::Change::writeTile.
  void replace(const GridIndex& tile, SemanticMap map);
  /// Adds evidence to a tile in the file. If the tile is damaged, the evidence comes back as an Arrival.
  void add(const GridIndex& tile, SemanticMap map);

  /// Replaces tiles in the file by copies of those in memory, and writes the drive and the journal. @return
  /// becomes ready when this and all earlier changes are durable.
  std::future<void> save(SemanticMap snapshot, std::vector<GridIndex> tiles, const DriveRecord& drive,
                         JournalChange journal = {});
  /// Empties the file.
  Call clear();
  /// Changes tiles of the file. @param change is called with a map that holds one of the tiles, and changes
  /// it.
  void changeTiles(std::vector<GridIndex> tiles, std::function<void(SemanticMap&)> change);
  void putDrive(const DriveRecord& drive);
  /// Forgets the journal.
  void eraseJournal();
  /// Notes in the journal that a box is cleared.
  void noteCleared(const Eigen::AlignedBox3d& box);
  /// Reads the packed points of a scan of the journal, and returns when that is done. May be called in any
  /// thread. @throws MapFileError, also if the file is closed meanwhile.
  std::string scanContent(std::uint64_t number);
  /// Copies the file. @return becomes ready when the copy is complete, or throws the error.
  std::future<void> copyTo(const std::string& path);

  /// Takes the arrivals since the last call, in the order of the calls that they answer.
  std::vector<Arrival> takeArrivals();
  /// Waits until every call so far has been tried at least once.
  void waitForTrial();
  /// Why changes fail at the moment; "" if they do not.
  std::string fault() const;
  /// Memory of the changes that are not yet durable [bytes].
  std::size_t waitingBytes() const;

  /// Tries the remaining changes once more, ends the thread, and waits for it. @return what was lost, and
  /// why; "" if nothing was.
  std::string close();

 private:
  /// @return whether the work must be repeated if the change fails.
  using Work = std::function<bool(MapFile& file, MapFile::Change& change, Call call)>;
  struct Job {
    Work work;
    std::size_t bytes = 0;
    std::optional<std::promise<void>> durable = std::nullopt;
    /// All earlier jobs come in other calls of tryJobs() than this one, which reads the list of drives.
    bool first = false;
    bool done = false;
    bool whole = false;  ///< with it and all earlier jobs, the file holds each scan exactly once
    bool reads = false;  ///< nothing is lost without it
  };

  Call enqueue(Job job);
  void run();
  /// Tries the next jobs, as one change or as a part of one. @return whether that succeeded.
  bool tryJobs(std::unique_lock<std::mutex>& lock);
  /// Runs jobs in the open change, and commits it if it ends with them.
  /// @param[out] late whether the commit before was made, although it had reported a failure.
  /// @param[out] committed whether a commit was tried. @return why that failed; "" if it has not.
  std::string perform(const std::vector<Job*>& jobs, Call call, bool ends, bool& late, bool& committed);
  /// The first jobs are durable.
  void end(std::size_t jobs, std::unique_lock<std::mutex>& lock);
  void arrive(Arrival arrival);

  std::optional<MapFile> file_;  ///< until close()
  const bool journalled_;
  std::optional<MapFile::Change> change_;  ///< that holds the executed jobs; of the thread
  bool writes_ = false;                    ///< whether any of them must be repeated if it fails
  const std::chrono::milliseconds retry_;

  mutable std::mutex mutex_;
  std::condition_variable wake_, tried_;
  std::deque<Job> jobs_;
  std::vector<Arrival> arrivals_;
  std::string fault_;
  std::size_t waiting_bytes_ = 0;
  Call called_ = 0, ended_ = 0;
  std::size_t executed_ = 0;    ///< the first of the jobs, which are not durable yet
  std::size_t last_trial_ = 0;  ///< number of jobs in the last commit that failed
  std::size_t failures_ = 0;    ///< number of trials that failed
  bool closing_ = false, closed_ = false;
  std::thread thread_;  ///< last, so that it starts after all other members
};

}  // namespace bki_mapping
