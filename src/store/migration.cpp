#include "store/migration.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "bki_mapping/store/map_file.h"
#include "core/atomic_file.h"
#include "store/records.h"
#include "store/schema.h"
#include "store/tile_codec.h"
#include "store/tile_rows.h"

namespace bki_mapping {
namespace {

/// Adds the column label_mask: all bits of a label are the class, as before.
void toVersion2(Database& database) {
  MapInfo info;
  TableRow table;
  Totals totals = readTotals(database, 1);
  totals.checksums -= readMapRow(database, 1, info, table);
  changeSchema(database, 2);
  totals.checksums += writeMapRow(database, info, table);
  writeTotals(database, 2, totals);
}

/// Tiles may hold looks; those of version 2 have none.
void toVersion3(Database&) {}

/// Adds the journal, without scans.
void toVersion4(Database& database) {
  const Totals totals = readTotals(database, 3);
  changeSchema(database, 4);
  writeTotals(database, 4, totals);
}

/// Writes all tiles in the layout of the next version.
void writeTilesAnew(Database& database, std::int64_t version) {
  Totals totals = readTotals(database, version);
  std::int64_t checksums = 0;
  MapInfo info;
  TableRow table;
  readMapRow(database, version, info, table);
  info.classes = std::make_shared<const ClassTable>(
      table.name, readClasses(database, totals.classes, checksums), table.label_mask);
  TileCodec before(*info.classes, tileLayoutOf(version)), after(*info.classes, tileLayoutOf(version + 1));
  after.setRules(rulesOfParameters(info.parameters));
  const GridIndex low{-kMostTileIndex, -kMostTileIndex, -kMostTileIndex},
      high{kMostTileIndex, kMostTileIndex, kMostTileIndex};
  for (const int part : readTileParts(database)) {
    for (const TileEntry& entry : readTileRange(database, low, high, part)) {
      const TileKey key{entry.index, part};
      SemanticMap tile = info.emptyMap();
      readTile(database, key, [&](const TileEntry&, const Statement::Bytes& content) {
        const std::string fault = before.unpack(key, entry, content.data, content.size);
        if (!fault.empty()) throw damaged(database.name(), nameOfTile(key) + ": " + fault);
        before.addTo(tile, key);
      });
      eraseTile(database, key, totals);
      insertTile(database, key, after.pack(tile, key), after.packed(), totals);
    }
  }
  writeTotals(database, version + 1, totals);
}

/// Tiles hold looks in another layout.
void toVersion5(Database& database) {
  writeTilesAnew(database, 4);
}

/// Tiles hold evidence in another layout.
void toVersion6(Database& database) {
  writeTilesAnew(database, 5);
}

/// All steps up to kFormatVersion. Whoever adds a version adds the step that leads to it, and a file of the
/// previous version in test/store/data.
const std::vector<MigrationStep>& allSteps() {
  static const std::vector<MigrationStep> steps = {
      {1, toVersion2}, {2, toVersion3}, {3, toVersion4}, {4, toVersion5}, {5, toVersion6}};
  return steps;
}

/// Reads all of a file. @throws MapFileError.
void checkAll(const std::string& path) {
  MapFile file(path, MapFile::Access::kRead);
  for (const int part : file.parts()) {
    for (const TileEntry& tile : file.tiles(part)) {
      SemanticMap map = file.info().emptyMap();
      file.addTileTo(map, {tile.index, part});
    }
  }
  for (const ScanRecord& scan : file.scans()) file.scanContent(scan.number);
}

}  // namespace

void migrate(Database& database, std::int64_t version, std::int64_t to,
             const std::vector<MigrationStep>& steps) {
  for (; version < to; ++version) {
    const auto step =
        std::find_if(steps.begin(), steps.end(), [&](const MigrationStep& s) { return s.from == version; });
    if (step == steps.end()) {
      throw std::logic_error("there is no migration from version " + std::to_string(version) +
                             " of map files to the next version");
    }
    step->run(database);
    database.run(("PRAGMA user_version = " + std::to_string(version + 1)).c_str());
  }
}

std::int64_t migrateMap(const std::string& old_path, const std::string& new_path) {
  if (std::filesystem::exists(new_path)) {
    throw MapFileError(new_path + " exists already; choose another name");
  }
  Database old(old_path, Database::Mode::kRead);
  const std::int64_t version = checkIdentity(old);
  old.lock();
  checkComplete(old);
  checkAll(old_path);  // steps rely on it
  try {
    AtomicFile file(new_path);
    {
      Database copy(file.temporaryPath(), Database::Mode::kNew, new_path);
      old.copyTo(copy);
      migrate(copy, version, kFormatVersion, allSteps());
    }
    checkAll(file.temporaryPath());
    file.commit();
  } catch (const MapFileError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw MapFileError(error.what());
  }
  return version;
}

}  // namespace bki_mapping
