#include "bki_mapping/store/map_file.h"

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <utility>

#include "store/database.h"
#include "store/journal_rows.h"
#include "store/map_file_state.h"
#include "store/records.h"
#include "store/schema.h"
#include "store/tile_codec.h"
#include "store/tile_rows.h"

namespace bki_mapping {
namespace {

void checkSameShape(const SemanticMap& map, const MapInfo& info) {
  if (map.geometry().resolution() == info.resolution && map.prior() == info.prior &&
      map.classCount() == info.classes->size()) {
    return;
  }
  throw std::invalid_argument(
      "the resolution, prior or number of classes of the map in memory is not that of the file");
}

}  // namespace

MapFile::MapFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
MapFile::~MapFile() = default;
MapFile::MapFile(MapFile&&) noexcept = default;
MapFile& MapFile::operator=(MapFile&&) noexcept = default;

MapFile::MapFile(const std::string& path, Access access) {
  const auto mode = access == Access::kRead ? Database::Mode::kRead : Database::Mode::kUpdate;
  state_ = std::make_unique<State>(path, mode, path);
  Database& database = state_->database;
  const std::int64_t version = checkIdentity(database);
  try {
    database.lock();
  } catch (const MapFileInUse&) {
    throw;
  } catch (const MapFileError&) {
    checkComplete(database);  // describes a truncated file better than SQLite does
    throw;
  }
  checkComplete(database);
  checkSchema(database, version);
  state_->readAll(version);
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
  return readTileParts(state_->database);
}

std::vector<TileEntry> MapFile::tiles(int part) {
  constexpr int kMost = kMostTileIndex;
  return tilesIn({-kMost, -kMost, -kMost}, {kMost, kMost, kMost}, part);
}

std::vector<TileEntry> MapFile::tilesIn(const GridIndex& low, const GridIndex& high, int part) {
  return readTileRange(state_->database, low, high, part);
}

std::optional<TileEntry> MapFile::findTile(const TileKey& key) {
  return readTileEntry(state_->database, key);
}

bool MapFile::addTileTo(SemanticMap& map, const TileKey& key) {
  checkSameShape(map, state_->info);
  const auto unpack = [&](const TileEntry& entry, const Statement::Bytes& content) {
    const std::string fault = state_->tileCodec().unpack(key, entry, content.data, content.size);
    if (!fault.empty()) throw damaged(path(), nameOfTile(key) + ": " + fault);
  };
  if (!readTile(state_->database, key, std::ref(unpack))) return false;
  state_->tileCodec().addTo(map, key);
  return true;
}

MapFileError withoutJournal(const std::string& path) {
  return MapFileError(path +
                      " is of a version of the format that has no journal of scans; convert it with "
                      "migrate_map, or do without the journal");
}

bool MapFile::hasJournal() const {
  return state_->version >= kFirstVersionWithJournal;
}

JournalSize MapFile::journalSize() {
  const Totals& totals = state_->totals;
  JournalSize size{0, static_cast<int>(totals.settings), static_cast<int>(totals.cleared)};
  if (hasJournal()) size.next_number = readNextNumber(state_->database);
  return size;
}

std::vector<ScanRecord> MapFile::scans() {
  return hasJournal() ? readScans(state_->database) : std::vector<ScanRecord>();
}

std::string MapFile::scanContent(std::uint64_t number) {
  return readScanContent(state_->database, number);
}

std::vector<std::string> MapFile::settings() {
  return hasJournal() ? readSettings(state_->database) : std::vector<std::string>();
}

std::vector<Eigen::AlignedBox3d> MapFile::clearedBoxes() {
  return hasJournal() ? readCleared(state_->database) : std::vector<Eigen::AlignedBox3d>();
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
  bki_mapping::eraseTile(state_->file.database, key, state_->totals);
}

void MapFile::Change::writeTile(const SemanticMap& map, const TileKey& key) {
  MapFile::State& file = state_->file;
  checkSameShape(map, file.info);
  if (key.part < 0) throw std::invalid_argument("the part of a tile is negative");
  TileCodec& codec = file.tileCodec();
  const TileEntry entry = codec.pack(map, key);
  eraseTile(key);
  if (entry.blocks == 0) return;
  insertTile(file.database, key, entry, codec.packed(), state_->totals);
}

void MapFile::Change::eraseDrive(const std::string& id) {
  MapFile::State& file = state_->file;
  Statement select = file.database.prepare("SELECT checksum FROM drive WHERE id = ?");
  select.bind(0, id);
  if (!select.step()) return;
  const std::int64_t checksum = select.integer(0);
  select.reset();
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

void MapFile::Change::requireJournal() const {
  if (state_->file.version >= kFirstVersionWithJournal) return;
  throw withoutJournal(state_->file.database.name());
}

void MapFile::Change::addScan(const ScanRecord& scan, const std::string& content) {
  requireJournal();
  if (scan.settings >= state_->totals.settings || scan.cleared > state_->totals.cleared) {
    throw std::invalid_argument("scan " + std::to_string(scan.number) +
                                " refers to settings or boxes that the file does not have");
  }
  insertScan(state_->file.database, scan, content, state_->totals);
}

void MapFile::Change::moveScan(const ScanRecord& scan) {
  requireJournal();
  updateScan(state_->file.database, scan, state_->totals);
}

int MapFile::Change::addSettings(const std::string& parameters) {
  requireJournal();
  checkText("the settings", parameters);
  insertSettings(state_->file.database, parameters, state_->totals);
  return static_cast<int>(state_->totals.settings) - 1;
}

int MapFile::Change::addClearedBox(const Eigen::AlignedBox3d& box) {
  requireJournal();
  if (box.min().hasNaN() || box.max().hasNaN())
    throw std::invalid_argument("a corner of the box is not a number");
  insertCleared(state_->file.database, box, state_->totals);
  return static_cast<int>(state_->totals.cleared);
}

void MapFile::Change::eraseJournal() {
  if (state_->file.version < kFirstVersionWithJournal) return;
  bki_mapping::eraseJournal(state_->file.database, state_->totals);
}

bool MapFile::Change::isOpen() const {
  return state_->file.database.inTransaction();
}

void MapFile::Change::commit() {
  MapFile::State& file = state_->file;
  if (!isOpen()) {
    throw MapFileError("a change of " + file.database.name() +
                       " was undone by an error of the disk; check the disk, and repeat the change");
  }
  writeTotals(file.database, file.version, state_->totals);
  state_->done = true;
  file.commit(state_->totals);
}

}  // namespace bki_mapping
