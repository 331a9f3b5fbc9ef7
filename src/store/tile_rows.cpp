#include "store/tile_rows.h"

#include <limits>
#include <utility>

namespace bki_mapping {
namespace {

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

void bindKey(Statement& statement, const TileKey& key) {
  int parameter = 0;
  for (const int number : {key.part, key.index.z, key.index.y, key.index.x}) {
    statement.bind(parameter++, std::int64_t{number});
  }
}

}  // namespace

void readTileList(Database& database, std::int64_t expected, Totals& found) {
  Statement select = database.prepare(kSelectList);
  std::pair<int, GridIndex> last{-1, {}};
  while (found.tiles <= expected && select.step()) {
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

std::vector<int> readTileParts(Database& database) {
  Statement next = database.prepare("SELECT min(part) FROM tile INDEXED BY tile_list WHERE part > ?");
  std::vector<int> parts;
  for (std::int64_t last = -1;;) {
    next.bind(0, last);
    if (!next.step() || next.isNull(0)) return parts;
    last = next.integer(0);
    if (last > std::numeric_limits<int>::max()) {
      throw damaged(database.name(), "the part of a tile is out of range");
    }
    parts.push_back(static_cast<int>(last));
    next.reset();
  }
}

std::vector<TileEntry> readTileRange(Database& database, const GridIndex& low, const GridIndex& high,
                                     int part) {
  Statement select = database.prepare(kSelectRange);
  int parameter = 0;
  for (const int number : {part, low.z, high.z, low.y, high.y, low.x, high.x}) {
    select.bind(parameter++, std::int64_t{number});
  }
  std::vector<TileEntry> entries;
  while (select.step()) entries.push_back(readEntry(select, database.name()));
  return entries;
}

std::optional<TileEntry> readTileEntry(Database& database, const TileKey& key) {
  Statement select = database.prepare(kSelectEntry);
  bindKey(select, key);
  if (!select.step()) return std::nullopt;
  return readEntry(select, database.name());
}

bool readTile(Database& database, const TileKey& key, const TileVisit& visit) {
  Statement select = database.prepare(kSelectTile);
  bindKey(select, key);
  if (!select.step()) return false;
  const TileEntry entry = readEntry(select, database.name());
  visit(entry, select.bytes(6));
  return true;
}

void insertTile(Database& database, const TileKey& key, const TileEntry& entry, const std::string& content,
                Totals& totals) {
  Statement insert = database.prepare("INSERT INTO tile VALUES (?,?,?,?,?,?,?,?)");
  bindKey(insert, key);
  insert.bind(4, std::int64_t{entry.blocks});
  insert.bind(5, std::int64_t{entry.planes});
  insert.bind(6, std::int64_t{entry.checksum});
  insert.bindBytes(7, content);
  insert.step();
  addTo(totals, key.part, entry, 1);
}

void eraseTile(Database& database, const TileKey& key, Totals& totals) {
  const std::optional<TileEntry> entry = readTileEntry(database, key);
  if (!entry) return;
  Statement erase = database.prepare("DELETE FROM tile WHERE part = ? AND z = ? AND y = ? AND x = ?");
  bindKey(erase, key);
  erase.step();
  addTo(totals, key.part, *entry, -1);
}

std::string nameOfTile(const TileKey& key) {
  return "tile (" + std::to_string(key.index.x) + ", " + std::to_string(key.index.y) + ", " +
         std::to_string(key.index.z) + ") of part " + std::to_string(key.part);
}

}  // namespace bki_mapping
