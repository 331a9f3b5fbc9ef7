#include "bki_mapping/store/map_file.h"

#include <filesystem>
#include <limits>
#include <utility>

#include "core/atomic_file.h"
#include "store/box_tiles.h"
#include "store/database.h"
#include "store/records.h"
#include "store/schema.h"
#include "store/tile_codec.h"

namespace bki_mapping {
namespace {

/// Tiles farther out contain no voxel with a valid index, nor any neighbour of one.
constexpr int kMostTileIndex = (1 << 22) + 1;
static_assert(GridGeometry::kMaxCoordinate == double{1 << 22} * kTileEdge);

// Statements that read the list of tiles. Their first columns are those that readEntry() reads.
constexpr char kSelectList[] =
    "SELECT x, y, z, blocks, planes, checksum, part FROM tile INDEXED BY tile_list";
constexpr char kSelectRange[] =
    "SELECT x, y, z, blocks, planes, checksum FROM tile INDEXED BY tile_list WHERE part = ? AND z BETWEEN ? "
    "AND ? AND y BETWEEN ? AND ? AND x BETWEEN ? AND ? ORDER BY z, y, x";
constexpr char kSelectEntry[] =
    "SELECT x, y, z, blocks, planes, checksum FROM tile INDEXED BY tile_list WHERE part = ? AND z = ? AND "
    "y = ? AND x = ?";
constexpr char kSelectTile[] =
    "SELECT x, y, z, blocks, planes, checksum, content FROM tile INDEXED BY tile_list WHERE part = ? AND "
    "z = ? AND y = ? AND x = ?";

/// The text that the library writes into MapInfo::program.
constexpr char kProgram[] = "bki_mapping " BKI_MAPPING_VERSION;

TileEntry readEntry(const Statement& row, const std::string& name) {
  const auto number = [&](int column, std::int64_t least, std::int64_t most) {
    const std::int64_t value = row.integer(column);
    if (value < least || value > most) throw damaged(name, "a number of a tile is out of range");
    return static_cast<int>(value);
  };
  TileEntry entry;
  entry.index.x = number(0, -kMostTileIndex, kMostTileIndex);
  entry.index.y = number(1, -kMostTileIndex, kMostTileIndex);
  entry.index.z = number(2, -kMostTileIndex, kMostTileIndex);
  entry.blocks = number(3, 1, Region::kBlocks);
  entry.planes = number(4, 0, Region::kBlocks * (static_cast<int>(kMaxClasses) + 1));
  const std::int64_t checksum = row.integer(5);
  if (checksum < 0 || checksum > 0xffffffff) throw damaged(name, "a checksum is out of range");
  entry.checksum = static_cast<std::uint32_t>(checksum);
  return entry;
}

void addTo(Totals& totals, int part, const TileEntry& entry, int sign) {
  RowChecksum checksum;
  for (const int number : {part, entry.index.z, entry.index.y, entry.index.x, entry.blocks, entry.planes}) {
    checksum.add(std::int64_t{number});
  }
  checksum.add(std::int64_t{entry.checksum});
  totals.tiles += sign;
  totals.blocks += sign * entry.blocks;
  totals.planes += sign * entry.planes;
  totals.checksums += sign * std::int64_t{checksum.value()};
}

std::string nameOf(const TileKey& key) {
  return "tile (" + std::to_string(key.index.x) + ", " + std::to_string(key.index.y) + ", " +
         std::to_string(key.index.z) + ") of part " + std::to_string(key.part);
}

void bindKey(Statement& statement, const TileKey& key) {
  int parameter = 0;
  for (const int number : {key.part, key.index.z, key.index.y, key.index.x}) {
    statement.bind(parameter++, std::int64_t{number});
  }
}

void checkSameShape(const SemanticMap& map, const MapInfo& info) {
  if (map.geometry().resolution() == info.resolution && map.prior() == info.prior &&
      map.classCount() == info.classes->size()) {
    return;
  }
  throw std::invalid_argument(
      "the resolution, prior or number of classes of the map in memory is not that of the file");
}

}  // namespace

struct MapFile::State {
  State(const std::string& path, Database::Mode mode, const std::string& name)
      : database(path, mode, name), writable(mode != Database::Mode::kRead) {}

  /// Reads and checks everything except the content of the tiles.
  void readAll() {
    std::string table_name;
    totals = readTotals(database);
    checkTotals();
    Totals found;
    const std::uint32_t map_row = readMapRow(database, info, table_name);
    found.checksums += map_row;
    std::vector<SemanticClass> classes = readClasses(database, totals.classes, found.checksums);
    found.classes = static_cast<std::int64_t>(classes.size());
    found.drives = static_cast<std::int64_t>(readDrives(database, totals.drives, found.checksums).size());
    try {
      info.classes = std::make_shared<const ClassTable>(table_name, std::move(classes));
      checkInfo(info);
    } catch (const std::invalid_argument& error) {
      throw damaged(database.name(), error.what());
    }
    readList(found);
    if (!(found == totals)) throw damaged(database.name(), "rows of its tables are missing or changed");
  }
  /// Checks the order of the list; searches rely on it.
  void readList(Totals& found) {
    Statement select = database.prepare(kSelectList);
    std::pair<int, GridIndex> last{-1, {}};
    while (found.tiles <= totals.tiles && select.step()) {
      const TileEntry entry = readEntry(select, database.name());
      const std::int64_t part = select.integer(6);
      if (part < 0 || part > std::numeric_limits<int>::max()) {
        throw damaged(database.name(), "the part of a tile is out of range");
      }
      const std::pair<int, GridIndex> key(static_cast<int>(part), entry.index);
      if (!(last < key)) throw damaged(database.name(), "its list of tiles is out of order");
      last = key;
      addTo(found, key.first, entry, 1);
    }
  }
  /// Refuses counts that are impossible in a file of this size, because memory is allocated by them.
  void checkTotals() const {
    const std::int64_t size = database.fileSize();
    bool too_many = totals.classes > static_cast<std::int64_t>(kMaxClasses);
    for (const std::int64_t count :
         {totals.classes, totals.drives, totals.tiles, totals.blocks, totals.planes}) {
      too_many |= count < 0 || count > size;
    }
    // The lists of blocks and planes are never compressed.
    if (too_many || 4 * totals.blocks + totals.planes > size) {
      throw damaged(database.name(), "it claims more content than it has room for");
    }
  }
  TileCodec& tileCodec() {
    if (!codec) codec = std::make_unique<TileCodec>(*info.classes);
    return *codec;
  }
  std::int64_t checksumOf(const std::string& drive) {
    Statement select = database.prepare("SELECT checksum FROM drive WHERE id = ?");
    select.bind(0, drive);
    return select.step() ? select.integer(0) : -1;
  }

  /// Makes an open transaction durable. @param next the totals of the file then.
  void commit(const Totals& next) {
    try {
      database.run("COMMIT");
      totals = next;
    } catch (...) {
      database.rollBack();
      if (database.mode() == Database::Mode::kNew) throw;
      attempted = next;
      bool made = false;
      try {
        made = settle();
      } catch (const MapFileError&) {
      }
      if (!made) throw;
    }
  }
  /// Finds out whether a commit() that failed has changed the file after all. That is so if only its last
  /// sync failed, with which SQLite discards the journal: SQLite then discards it the next time.
  /// @return whether the file has changed. @throws MapFileError if that cannot be determined now.
  bool settle() {
    if (!attempted) return false;
    const Totals found = readTotals(database);
    const bool made = found == *attempted && !(found == totals);
    totals = found;
    attempted.reset();
    return made;
  }

  Database database;
  bool writable;
  MapInfo info;
  Totals totals;
  std::optional<Totals> attempted;  ///< the totals after a commit() that failed, until its outcome is known
  std::unique_ptr<TileCodec> codec;
};

MapFile::MapFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
MapFile::~MapFile() = default;
MapFile::MapFile(MapFile&&) noexcept = default;
MapFile& MapFile::operator=(MapFile&&) noexcept = default;

MapFile::MapFile(const std::string& path, Access access) {
  const auto mode = access == Access::kRead ? Database::Mode::kRead : Database::Mode::kUpdate;
  state_ = std::make_unique<State>(path, mode, path);
  Database& database = state_->database;
  checkIdentity(database);
  try {
    database.lock();
  } catch (const MapFileInUse&) {
    throw;
  } catch (const MapFileError&) {
    checkComplete(database);  // describes a truncated file better than SQLite does
    throw;
  }
  checkComplete(database);
  checkSchema(database);
  state_->readAll();
}

MapFile MapFile::create(const std::string& path, const MapInfo& info) {
  if (std::filesystem::exists(path)) {
    throw MapFileError(path + " exists already; open it for update, or choose another name");
  }
  NewMapFile(path, info).commit();
  return MapFile(path, Access::kUpdate);
}

const std::string& MapFile::path() const {
  return state_->database.name();
}

const MapInfo& MapFile::info() const {
  return state_->info;
}

MapFile::Size MapFile::size() const {
  const Totals& totals = state_->totals;
  return {static_cast<std::uint64_t>(totals.tiles), static_cast<std::uint64_t>(totals.blocks),
          static_cast<std::uint64_t>(totals.planes), static_cast<std::uint64_t>(state_->database.fileSize())};
}

std::vector<DriveRecord> MapFile::drives() {
  std::int64_t ignored = 0;
  return readDrives(state_->database, std::nullopt, ignored);  // an open change may have added some
}

std::vector<int> MapFile::parts() {
  Statement next = state_->database.prepare("SELECT min(part) FROM tile INDEXED BY tile_list WHERE part > ?");
  std::vector<int> parts;
  for (std::int64_t last = -1;;) {
    next.bind(0, last);
    if (!next.step() || next.isNull(0)) return parts;
    last = next.integer(0);
    if (last > std::numeric_limits<int>::max()) throw damaged(path(), "the part of a tile is out of range");
    parts.push_back(static_cast<int>(last));
    next.reset();
  }
}

std::vector<TileEntry> MapFile::tiles(int part) {
  constexpr int kMost = kMostTileIndex;
  return tilesIn({-kMost, -kMost, -kMost}, {kMost, kMost, kMost}, part);
}

std::vector<TileEntry> MapFile::tilesIn(const GridIndex& low, const GridIndex& high, int part) {
  Statement select = state_->database.prepare(kSelectRange);
  int parameter = 0;
  for (const int number : {part, low.z, high.z, low.y, high.y, low.x, high.x}) {
    select.bind(parameter++, std::int64_t{number});
  }
  std::vector<TileEntry> entries;
  while (select.step()) entries.push_back(readEntry(select, state_->database.name()));
  return entries;
}

std::optional<TileEntry> MapFile::findTile(const TileKey& key) {
  Statement select = state_->database.prepare(kSelectEntry);
  bindKey(select, key);
  if (!select.step()) return std::nullopt;
  return readEntry(select, state_->database.name());
}

bool MapFile::addTileTo(SemanticMap& map, const TileKey& key) {
  checkSameShape(map, state_->info);
  Statement select = state_->database.prepare(kSelectTile);
  bindKey(select, key);
  if (!select.step()) return false;
  const TileEntry entry = readEntry(select, state_->database.name());
  const Statement::Bytes content = select.bytes(6);
  const std::string fault = state_->tileCodec().unpack(key, entry, content.data, content.size);
  if (!fault.empty()) throw damaged(state_->database.name(), nameOf(key) + ": " + fault);
  state_->tileCodec().addTo(map, key);
  return true;
}

struct MapFile::Change::State {
  MapFile::State& file;
  Totals totals;
  bool done = false;
};

MapFile::Change::Change(MapFile& file)
    : state_(std::make_unique<State>(State{*file.state_, file.state_->totals})) {
  file.state_->database.run("BEGIN");
}

MapFile::Change::Change(Change&&) noexcept = default;
MapFile::Change::~Change() {
  if (state_ && !state_->done) state_->file.database.rollBack();
}

MapFile::Change MapFile::change() {
  if (!state_->writable) throw std::logic_error(state_->database.name() + " is open for reading only");
  if (state_->settle()) {
    throw MapFileLateCommit(path() + " holds the last change, although writing it failed; do not repeat it");
  }
  return Change(*this);
}

void MapFile::Change::eraseTile(const TileKey& key) {
  MapFile::State& file = state_->file;
  Statement select = file.database.prepare(kSelectEntry);
  bindKey(select, key);
  if (!select.step()) return;
  addTo(state_->totals, key.part, readEntry(select, file.database.name()), -1);
  select.reset();
  Statement erase = file.database.prepare("DELETE FROM tile WHERE part = ? AND z = ? AND y = ? AND x = ?");
  bindKey(erase, key);
  erase.step();
}

void MapFile::Change::writeTile(const SemanticMap& map, const TileKey& key) {
  MapFile::State& file = state_->file;
  checkSameShape(map, file.info);
  if (key.part < 0) throw std::invalid_argument("the part of a tile is negative");
  TileCodec& codec = file.tileCodec();
  const TileEntry entry = codec.pack(map, key);
  eraseTile(key);
  if (entry.blocks == 0) return;
  Statement insert = file.database.prepare("INSERT INTO tile VALUES (?,?,?,?,?,?,?,?)");
  bindKey(insert, key);
  insert.bind(4, std::int64_t{entry.blocks});
  insert.bind(5, std::int64_t{entry.planes});
  insert.bind(6, std::int64_t{entry.checksum});
  insert.bindBytes(7, codec.packed());
  insert.step();
  addTo(state_->totals, key.part, entry, 1);
}

void MapFile::Change::eraseDrive(const std::string& id) {
  MapFile::State& file = state_->file;
  const std::int64_t checksum = file.checksumOf(id);
  if (checksum < 0) return;
  Statement erase = file.database.prepare("DELETE FROM drive WHERE id = ?");
  erase.bind(0, id);
  erase.step();
  state_->totals.drives -= 1;
  state_->totals.checksums -= checksum;
}

void MapFile::Change::putDrive(const DriveRecord& drive) {
  checkDrive(drive);
  eraseDrive(drive.id);
  Statement insert = state_->file.database.prepare("INSERT INTO drive VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)");
  state_->totals.checksums += writeDriveRow(insert, drive);
  state_->totals.drives += 1;
}

void MapFile::Change::commit() {
  MapFile::State& file = state_->file;
  writeTotals(file.database, state_->totals);
  state_->done = true;
  file.commit(state_->totals);
}

namespace {

/// Keeps others from opening a file that is about to be replaced. A journal that a killed process left is
/// applied first; otherwise SQLite would apply it to the new file.
std::optional<Database> lockReplaced(const std::string& path) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    Database old(path, Database::Mode::kUpdate);
    checkIdentity(old);
    old.lock();
    return old;
  } catch (const MapFileInUse&) {
    throw;
  } catch (const MapFileError&) {
    return std::nullopt;  // not a map, or a damaged one: replaced like any other file
  }
}

/// Removes files that SQLite would take for a part of a new file with this name. The removal is durable
/// before the new file appears.
void removeLeftovers(const std::string& path) {
  std::error_code ignored;
  const std::string target = std::filesystem::weakly_canonical(path, ignored).string();
  bool removed = false;
  for (const char* suffix : {"-journal", "-wal", "-shm"}) {
    removed |= std::filesystem::remove(target + suffix, ignored);
  }
  if (removed) syncFolder(target);
}

}  // namespace

struct NewMapFile::State {
  State(const std::string& file_path, const MapInfo& info, bool is_locked)
      : path(file_path), replaced(is_locked ? std::nullopt : lockReplaced(path)), atomic(path) {
    auto state = std::make_unique<MapFile::State>(atomic.temporaryPath(), Database::Mode::kNew, path);
    state->database.run("BEGIN");
    createSchema(state->database);
    state->totals.checksums += writeMapRow(state->database, info);
    Statement insert = state->database.prepare("INSERT INTO class VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
    for (const SemanticClass& c : info.classes->classes()) {
      state->totals.checksums += writeClassRow(insert, state->totals.classes++, c);
    }
    writeTotals(state->database, state->totals);
    state->database.run("COMMIT");
    state->info = info;
    file = MapFile(std::move(state));
  }

  std::string path;
  std::optional<Database> replaced;
  AtomicFile atomic;
  MapFile file{std::unique_ptr<MapFile::State>()};
  std::optional<MapFile::Change> change;
};

NewMapFile::NewMapFile(const std::string& path, const MapInfo& given, const MapFile* replaced) {
  MapInfo info = given;
  info.program = kProgram;
  checkInfo(info);
  try {
    state_ = std::make_unique<State>(path, info, replaced != nullptr);
  } catch (const MapFileError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw MapFileError(error.what());
  }
  state_->change.emplace(state_->file.change());
}

NewMapFile::~NewMapFile() = default;

MapFile::Change& NewMapFile::content() {
  return *state_->change;
}

void NewMapFile::commit() {
  state_->change->commit();
  state_->change.reset();
  state_->file = MapFile(std::unique_ptr<MapFile::State>());
  try {
    removeLeftovers(state_->path);
    state_->atomic.commit();
  } catch (const std::runtime_error& error) {
    throw MapFileError(error.what());
  }
}

}  // namespace bki_mapping
