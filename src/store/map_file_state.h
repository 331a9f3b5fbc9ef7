/// @file An open map file, for MapFile and NewMapFile.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "bki_mapping/store/map_file.h"
#include "store/database.h"
#include "store/records.h"
#include "store/schema.h"
#include "store/tile_codec.h"

namespace bki_mapping {

struct MapFile::State {
  State(const std::string& path, Database::Mode mode, const std::string& name)
      : database(path, mode, name), writable(mode != Database::Mode::kRead) {}

  /// Reads and checks everything except the content of the tiles. @param version of the file.
  void readAll(std::int64_t version);
  /// Made when first asked for.
  TileCodec& tileCodec();
  /// Makes an open transaction durable. @param next the totals of the file then.
  void commit(const Totals& next);
  /// Finds out whether a commit() that failed has changed the file after all. That is so if only its last
  /// sync failed, with which SQLite discards the journal: SQLite then discards it the next time.
  /// @return whether the file has changed. @throws MapFileError if that cannot be determined now.
  bool settle();

  Database database;
  bool writable;
  std::int64_t version = kFormatVersion;  ///< of the file
  MapInfo info;
  Totals totals;

 private:
  /// Refuses counts that are impossible in a file of this size, because memory is allocated by them.
  void checkTotals() const;

  std::optional<Totals> attempted_;  ///< the totals after a commit() that failed, until its outcome is known
  std::unique_ptr<TileCodec> codec_;
};

}  // namespace bki_mapping
