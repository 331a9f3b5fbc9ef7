#include "bki_mapping/store/map_keeper.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <new>
#include <set>
#include <stdexcept>
#include <utility>

#include "bki_mapping/map/semantic_map.h"
#include "store/drives.h"
#include "store/eviction.h"
#include "store/tile_store.h"

namespace bki_mapping {
namespace {

/// Time for adding tiles from the file, in addition to the first one, for each call.
constexpr std::chrono::milliseconds kArrivalTime(2);

/// While more than this waits to be written [bytes], tiles stay in the map: handing them over frees no
/// memory.
constexpr std::size_t kMostWaiting = 256 << 20;

/// With a journal, a save is due when this much waits for it [bytes].
constexpr std::size_t kMostUnsaved = 64 << 20;

enum class Here {
  kWhole,    ///< all evidence is in memory; a tile in the file is out of date
  kPart,     ///< the evidence is the sum of what is in memory and in the file
  kLoading,  ///< likewise, and the tile in the file has been requested
  kDamaged   ///< likewise, but the tile in the file cannot be read; the rest stays in memory
};

struct Tile {
  Here here = Here::kWhole;
  bool changed = false;      ///< memory has evidence that is not in the file
  TileStore::Call load = 0;  ///< the call that requested the tile
};

MapFile openOrCreate(const std::string& path, const MapInfo& info) {
  if (!std::filesystem::exists(path)) return MapFile::create(path, info);
  MapFile file(path, MapFile::Access::kUpdate);
  checkFits(file, info);
  return file;
}

}  // namespace

struct MapKeeper::State {
  State(SemanticMapper& of, MapFile file, const DriveRecord& first_drive, bool journal)
      : mapper(of),
        path(file.path()),
        drive(first_drive),
        edge(Region::kEdge * of.map().geometry().blockSize()),
        eviction(edge) {
    drives = file.drives();
    const auto is_same = [&](const DriveRecord& known) { return known.id == drive.id; };
    if (std::any_of(drives.begin(), drives.end(), is_same)) {
      throw std::invalid_argument("the map in " + path + " already holds drive '" + drive.id +
                                  "'; give the new drive another id");
    }
    if (journal && !file.hasJournal()) throw withoutJournal(path);
    for (const TileEntry& tile : file.tiles()) stored.insert(tile.index);
    journal_size = file.journalSize();
    journalled = journal || journal_size.next_number > 0;
    store = std::make_unique<TileStore>(std::move(file), journalled);
  }

  /// Distance of a tile from the window's centre: the largest of its distances on the three axes [m].
  double distance(const GridIndex& tile) const {
    const Eigen::Array3d low = edge * Eigen::Array3d(tile.x, tile.y, tile.z);
    const Eigen::Array3d centre = window.centre.array();
    return (low - centre).max(centre - (low + edge)).maxCoeff();
  }

  /// The tiles in the file within a distance of the window's centre.
  std::vector<GridIndex> storedWithin(double limit) const {
    std::vector<GridIndex> tiles;
    const Eigen::Array3d low = ((window.centre.array() - limit) / edge).floor();
    const Eigen::Array3d high = ((window.centre.array() + limit) / edge).floor();
    if (!((high - low + 1.0).tail<2>().prod() < static_cast<double>(stored.size()))) {
      std::copy_if(stored.begin(), stored.end(), std::back_inserter(tiles),
                   [&](const GridIndex& tile) { return distance(tile) <= limit; });
      return tiles;
    }
    const Eigen::Array3i first = low.cast<int>(), last = high.cast<int>();
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (auto tile = stored.lower_bound({first.x(), y, z});
             tile != stored.end() && tile->z == z && tile->y == y && tile->x <= last.x(); ++tile) {
          tiles.push_back(*tile);
        }
      }
    }
    return tiles;
  }

  void noteChange(const GridIndex& tile) {
    const auto [known, added] = here.try_emplace(tile);
    if (added && stored.count(tile) > 0) known->second.here = Here::kPart;
    known->second.changed = true;
  }

  void noteStored(const GridIndex& tile, bool is_stored) {
    if (is_stored) {
      stored.insert(tile);
    } else {
      stored.erase(tile);
    }
  }

  void noteMoved(const SemanticMap& blocks) {
    for (const auto& [index, block] : blocks.entries()) moved.push_back(index);
  }

  void load(const GridIndex& tile) {
    Tile& entry = here[tile];
    entry.here = Here::kLoading;
    entry.load = store->load(tile);
  }

  /// Adds blocks to the map, and notes them for the next moveTo().
  void addToMap(SemanticMap&& blocks) {
    noteMoved(blocks);
    mapper.addMap(std::move(blocks));
  }

  void take(TileStore::Arrival& arrival) {
    using Kind = TileStore::Arrival::Kind;
    if (arrival.call <= reset_call) return;
    const auto known = here.find(arrival.tile);
    const bool awaited = known != here.end() && known->second.load == arrival.call;
    if (arrival.kind != Kind::kReturned && !awaited) return;
    addToMap(std::move(arrival.map));
    if (arrival.kind == Kind::kLoaded) {
      known->second.here = Here::kWhole;
    } else {
      here[arrival.tile] = {Here::kDamaged, true, 0};
      damaged.insert(arrival.tile);
    }
  }

  /// Adds arrived tiles to the map. @param all adds all of them, even if that takes long.
  void takeArrivals(bool all) {
    for (TileStore::Arrival& arrival : store->takeArrivals()) arrivals.push_back(std::move(arrival));
    const auto end = std::chrono::steady_clock::now() + kArrivalTime;
    while (!arrivals.empty()) {
      try {
        take(arrivals.front());
      } catch (const std::bad_alloc&) {
        return;  // tries again when there is memory
      }
      arrivals.pop_front();
      if (!all && std::chrono::steady_clock::now() > end) return;
    }
  }

  bool writes() const { return store->fault().empty() && store->waitingBytes() < kMostWaiting; }
  bool mayLeave(const Tile& tile) const { return tile.here != Here::kDamaged && (!tile.changed || writes()); }

  using TileIterator = std::map<GridIndex, Tile>::iterator;
  TileIterator giveAway(TileIterator entry) {
    const auto& [index, tile] = *entry;
    SemanticMap map = mapper.takeRegion(index);
    noteMoved(map);
    if (tile.here != Here::kWhole) {
      if (map.size() > 0) store->add(index, std::move(map));
    } else if (tile.changed) {
      noteStored(index, map.size() > 0);
      store->replace(index, std::move(map));
    }
    return here.erase(entry);
  }

  void sweep() {
    must_sweep = false;
    swept_at = window.centre;
    for (auto entry = here.begin(); entry != here.end();) {
      entry = eviction.leaves(distance(entry->first)) && mayLeave(entry->second) ? giveAway(entry)
                                                                                 : std::next(entry);
    }
    for (const GridIndex& tile : storedWithin(eviction.loadingReach())) {
      const auto known = here.find(tile);
      if (known == here.end() || known->second.here == Here::kPart) load(tile);
    }
  }

  /// Adds what change() was given, as far as there is memory.
  void addDifferences() {
    for (; !differences.empty(); differences.pop_front()) {
      auto& [tile, part] = differences.front();
      if (here.count(tile) == 0 && stored.count(tile) > 0) {
        store->add(tile, std::move(part));
        continue;
      }
      try {
        addToMap(std::move(part));
      } catch (const std::bad_alloc&) {
        return;  // tries again when there is memory
      }
      must_sweep |= here.count(tile) == 0;
      noteChange(tile);
    }
  }

  /// Adds all that change() was given, if need be without the tiles in memory, so that a save holds it.
  void addAllDifferences() {
    addDifferences();
    std::deque<std::pair<GridIndex, SemanticMap>> left;
    for (auto& [tile, part] : differences) {
      const auto known = here.find(tile);
      if (known != here.end() && known->second.here == Here::kDamaged) {
        left.emplace_back(tile, std::move(part));
        continue;
      }
      if (known != here.end()) giveAway(known);
      stored.insert(tile);
      store->add(tile, std::move(part));
      must_sweep = true;
    }
    differences = std::move(left);
  }

  /// Changes those of some tiles whose evidence is, or is partly, in the file.
  /// @param change as in TileStore::changeTiles.
  void changeStored(const std::vector<GridIndex>& tiles, std::function<void(SemanticMap&)> change) {
    std::vector<GridIndex> in_file;
    for (const GridIndex& tile : tiles) {
      if (stored.count(tile) == 0) continue;
      const auto known = here.find(tile);
      const bool stays =
          known != here.end() && (known->second.here == Here::kWhole || known->second.here == Here::kDamaged);
      if (!stays) in_file.push_back(tile);
    }
    if (in_file.empty()) return;
    store->changeTiles(in_file, std::move(change));
    for (const GridIndex& tile : in_file) {  // requests from before the change are out of date
      const auto known = here.find(tile);
      if (known != here.end() && known->second.here == Here::kLoading) load(tile);
    }
  }

  double memoryLimit() const { return 1e6 * mapper.config().memory_limit; }  ///< [bytes]

  /// Hands over the farthest tiles until the map takes less memory than a limit [bytes], and shrinks the
  /// window to the tiles that are left. @return whether any tile was handed over.
  bool shrinkTo(double bytes) {
    std::vector<std::pair<double, GridIndex>> tiles;
    for (const auto& [index, tile] : here) {
      if (mayLeave(tile)) tiles.emplace_back(distance(index), index);
    }
    std::sort(tiles.begin(), tiles.end());
    bool any = false;
    for (; !tiles.empty() && static_cast<double>(mapper.mapBytes()) > bytes; tiles.pop_back()) {
      const auto& [from_centre, index] = tiles.back();
      if (from_centre <= 0.0) break;  // the sensor is in this tile
      eviction.shrinkBelow(from_centre);
      giveAway(here.find(index));
      any = true;
    }
    return any;
  }

  void keepWithinMemory() {
    const auto bytes = static_cast<double>(mapper.mapBytes());
    if (const auto enough = Eviction::bytesWhenShort(bytes, memoryLimit())) {
      shrinkTo(*enough);
    } else if (must_sweep) {
      eviction.grow(bytes, memoryLimit());
    }
  }

  SemanticMapper& mapper;
  std::string path;
  DriveRecord drive;
  double edge;  ///< of a tile [m]
  Eviction eviction;
  std::vector<DriveRecord> drives;  ///< the other drives in the map
  std::unique_ptr<TileStore> store;
  bool journalled = false;  ///< the file has a journal
  JournalSize journal_size;
  std::function<JournalChange()> take_journal;
  std::deque<TileStore::Arrival> arrivals;
  std::map<GridIndex, Tile> here;           ///< the tiles that are in memory, or have been requested
  std::set<GridIndex> stored;               ///< the tiles in the file, once all changes are written
  std::set<GridIndex> damaged;              ///< the tiles of the file that cannot be read
  Window window;                            ///< at the last moveTo()
  Eigen::Vector3d swept_at{0.0, 0.0, 0.0};  ///< centre of the window at the last sweep
  bool must_sweep = true;                   ///< sweep even if the window has not moved
  TileStore::Call reset_call = 0;           ///< the last reset; answers to earlier calls are ignored
  std::deque<std::pair<GridIndex, SemanticMap>> differences;  ///< of tiles, which are still to be added
  std::vector<GridIndex> moved;  ///< blocks that were added or removed, for the next moveTo()
  bool closed = false;
};

MapKeeper::MapKeeper(SemanticMapper& mapper, const std::string& path, const MapInfo& info,
                     const DriveRecord& drive, bool journal)
    : state_(std::make_unique<State>(mapper, openOrCreate(path, info), drive, journal)) {
  if (mapper.map().size() > 0) throw std::logic_error("the map of the mapper is not empty");
}

MapKeeper::~MapKeeper() {
  close();
}

void MapKeeper::addScan(std::uint64_t stamp) {
  State& s = *state_;
  const std::vector<GridIndex>& touched = s.mapper.touchedBlocks();
  s.drive.addScan(stamp, s.mapper.map().geometry(), touched);
  std::set<GridIndex> tiles;
  for (const GridIndex& block : touched) tiles.insert(SemanticMap::regionOf({block}));
  for (const GridIndex& tile : tiles) s.noteChange(tile);
}

std::vector<GridIndex> MapKeeper::moveTo(const Window& window) {
  State& s = *state_;
  s.must_sweep |= s.eviction.setWindow(window.edge);
  s.window = window;
  s.takeArrivals(false);
  s.addDifferences();
  const double moved = (window.centre - s.swept_at).cwiseAbs().maxCoeff();
  s.must_sweep |= s.eviction.isDue(moved);
  s.keepWithinMemory();
  if (s.must_sweep) s.sweep();
  return std::exchange(s.moved, {});
}

bool MapKeeper::makeRoom() {
  return state_->shrinkTo(Eviction::bytesToMakeRoom(state_->memoryLimit()));
}

std::vector<GridIndex> MapKeeper::waitForTiles() {
  state_->store->waitForTrial();
  state_->takeArrivals(true);
  return std::exchange(state_->moved, {});
}

void MapKeeper::keepJournal(std::function<JournalChange()> take) {
  state_->take_journal = std::move(take);
}

const JournalSize& MapKeeper::journalSize() const {
  return state_->journal_size;
}

void MapKeeper::forgetJournal() {
  save();
  state_->store->eraseJournal();
  state_->journal_size.settings = state_->journal_size.cleared = 0;
}

std::string MapKeeper::scanContent(std::uint64_t number) {
  return state_->store->scanContent(number);
}

bool MapKeeper::wantsSave() const {
  return state_->journalled && state_->store->waitingBytes() > kMostUnsaved;
}

std::future<void> MapKeeper::save() {
  State& s = *state_;
  if (s.journalled) s.addAllDifferences();
  std::vector<GridIndex> copies;
  for (auto entry = s.here.begin(); entry != s.here.end();) {
    auto& [index, tile] = *entry;
    if (!tile.changed || tile.here == Here::kDamaged) {
      ++entry;
    } else if (tile.here == Here::kWhole) {
      copies.push_back(index);
      s.noteStored(index, s.mapper.map().hasRegion(index));
      tile.changed = false;
      ++entry;
    } else {  // the file adds up both; their sum is loaded if the tile is in the window
      entry = s.giveAway(entry);
    }
  }
  std::future<void> saved = s.store->save(s.mapper.snapshot().map, std::move(copies), s.drive,
                                          s.take_journal ? s.take_journal() : JournalChange());
  s.sweep();
  return saved;
}

std::future<void> MapKeeper::saveTo(const std::string& path) {
  save();
  return state_->store->copyTo(path);
}

void MapKeeper::reset(const DriveRecord& drive) {
  State& s = *state_;
  s.reset_call = s.store->clear();
  s.journal_size.settings = s.journal_size.cleared = 0;
  s.here.clear();
  s.stored.clear();
  s.damaged.clear();
  s.moved.clear();
  s.differences.clear();
  s.mapper.reset();
  s.drive = drive;
  s.drives.clear();
  s.eviction.reset();
}

void MapKeeper::change(SemanticMap difference) {
  State& s = *state_;
  s.mapper.map().checkAddable(difference);
  std::vector<GridIndex> touched;
  for (const auto& [index, block] : difference.entries()) touched.push_back(index);
  s.drive.addTouched(s.mapper.map().geometry(), touched);
  for (const GridIndex& tile : difference.regions()) {
    s.differences.emplace_back(tile, difference.takeRegion(tile));
  }
  s.addDifferences();
}

void MapKeeper::addMap(SemanticMap other, const std::vector<DriveRecord>& drives, bool allow_overlap) {
  State& s = *state_;
  s.mapper.map().checkAddable(other);
  checkNotAdded("the map in " + s.path, s.drives, drives, allow_overlap);
  checkNotAdded("the map in " + s.path, {s.drive}, drives, allow_overlap);
  for (const GridIndex& tile : other.regions()) {
    SemanticMap part = other.takeRegion(tile);
    if (s.here.count(tile) > 0) {
      s.addToMap(std::move(part));
      s.noteChange(tile);
    } else {
      s.stored.insert(tile);
      s.store->add(tile, std::move(part));
    }
  }
  for (const DriveRecord& drive : drives) {
    s.drives.push_back(drive);
    s.store->putDrive(drive);
  }
  s.must_sweep = true;
}

std::vector<GridIndex> MapKeeper::clearBox(const Eigen::AlignedBox3d& box) {
  State& s = *state_;
  s.takeArrivals(true);
  if (s.journalled) {
    s.addAllDifferences();
    s.store->noteCleared(box);
  }
  std::vector<GridIndex> changed = s.mapper.clearBox(box);
  for (const GridIndex& block : changed) s.noteChange(SemanticMap::regionOf({block}));
  std::vector<GridIndex> in_box;
  for (const GridIndex& tile : s.stored) {
    const Eigen::Vector3d low = s.edge * Eigen::Vector3d(tile.x, tile.y, tile.z);
    if (box.intersects({low, low + Eigen::Vector3d::Constant(s.edge)})) in_box.push_back(tile);
  }
  s.changeStored(in_box, [box](SemanticMap& map) { bki_mapping::clearBox(map, box); });
  return changed;
}

std::vector<GridIndex> MapKeeper::replaceLooks(const GridIndex& tile, const LooksByBlock& looks) {
  State& s = *state_;
  s.takeArrivals(true);
  if (s.journalled) s.addAllDifferences();
  std::vector<GridIndex> changed = s.mapper.replaceLooks(tile, looks);
  if (!changed.empty()) s.noteChange(tile);
  s.changeStored(std::vector<GridIndex>{tile},
                 [tile, looks](SemanticMap& map) { bki_mapping::replaceLooks(map, tile, looks); });
  return changed;
}

std::vector<GridIndex> MapKeeper::storedTiles() const {
  return {state_->stored.begin(), state_->stored.end()};
}

std::string MapKeeper::fault() const {
  const std::string fault = state_->store->fault();
  if (!fault.empty() || state_->damaged.empty()) return fault;
  return state_->path + " is damaged in " + std::to_string(state_->damaged.size()) +
         " tiles that cannot be read; they stay as they are, and new evidence there will be lost at the end; "
         "use another copy of the file";
}

std::size_t MapKeeper::waitingBytes() const {
  return state_->store->waitingBytes();
}

const std::string& MapKeeper::path() const {
  return state_->path;
}

std::string MapKeeper::close() {
  State& s = *state_;
  if (std::exchange(s.closed, true)) return "";
  save();
  const std::string lost = s.store->close();
  s.takeArrivals(true);
  return lost.empty() ? fault() : lost;
}

}  // namespace bki_mapping
