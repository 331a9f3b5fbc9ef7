#include "store/map_file_state.h"

#include <stdexcept>
#include <utility>
#include <vector>

#include "store/journal_rows.h"
#include "store/tile_rows.h"

namespace bki_mapping {

void MapFile::State::readAll(std::int64_t version_of_file) {
  version = version_of_file;
  TableRow table;
  totals = readTotals(database, version);
  checkTotals();
  Totals found;
  const std::uint32_t map_row = readMapRow(database, version, info, table);
  found.checksums += map_row;
  std::vector<SemanticClass> classes = readClasses(database, totals.classes, found.checksums);
  found.classes = static_cast<std::int64_t>(classes.size());
  found.drives = static_cast<std::int64_t>(readDrives(database, totals.drives, found.checksums).size());
  try {
    info.classes = std::make_shared<const ClassTable>(table.name, std::move(classes), table.label_mask);
    checkInfo(info);
  } catch (const std::invalid_argument& error) {
    throw damaged(database.name(), error.what());
  }
  readTileList(database, totals.tiles, found);
  if (version >= kFirstVersionWithJournal) readJournal(database, totals, found);
  if (!(found == totals)) throw damaged(database.name(), "rows of its tables are missing or changed");
}

void MapFile::State::checkTotals() const {
  const std::int64_t size = database.fileSize();
  bool too_many = totals.classes > static_cast<std::int64_t>(kMaxClasses);
  for (const std::int64_t count : {totals.classes, totals.drives, totals.tiles, totals.blocks, totals.planes,
                                   totals.scans, totals.settings, totals.cleared}) {
    too_many |= count < 0 || count > size;
  }
  // The lists of blocks and planes are never compressed.
  if (too_many || 4 * totals.blocks + totals.planes > size) {
    throw damaged(database.name(), "it claims more content than it has room for");
  }
}

TileCodec& MapFile::State::tileCodec() {
  if (codec_) return *codec_;
  codec_ = std::make_unique<TileCodec>(*info.classes, tileLayoutOf(version));
  if (database.mode() != Database::Mode::kRead) codec_->setRules(rulesOfParameters(info.parameters));
  return *codec_;
}

void MapFile::State::commit(const Totals& next) {
  try {
    database.run("COMMIT");
    totals = next;
  } catch (...) {
    database.rollBack();
    if (database.mode() == Database::Mode::kNew) throw;
    attempted_ = next;
    bool made = false;
    try {
      made = settle();
    } catch (const MapFileError&) {
    }
    if (!made) throw;
  }
}

bool MapFile::State::settle() {
  if (!attempted_) return false;
  const Totals found = readTotals(database, version);
  const bool made = found == *attempted_ && !(found == totals);
  totals = found;
  attempted_.reset();
  return made;
}

}  // namespace bki_mapping
