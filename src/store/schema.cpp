#include "store/schema.h"

#include <array>
#include <cstring>
#include <string>

namespace bki_mapping {
namespace {

struct SchemaEntry {
  const char *type, *name, *sql;
  std::int64_t first = 1, last = kFormatVersion;  ///< versions that have it

  bool isOf(std::int64_t version) const { return first <= version && version <= last; }
};

// Sorted by name. The index covers the list of tiles, so that a list is read without any content.
constexpr SchemaEntry kSchema[] = {
    {"table", "class",
     "CREATE TABLE class (position INTEGER, id INTEGER, name TEXT, red INTEGER, green INTEGER, blue INTEGER, "
     "raw TEXT, any_raw INTEGER, unlabelled INTEGER, dynamic INTEGER, ground INTEGER, ignored INTEGER, "
     "free_gain REAL, checksum INTEGER)"},
    {"table", "cleared",
     "CREATE TABLE cleared (number INTEGER PRIMARY KEY, min_x REAL, min_y REAL, min_z REAL, max_x REAL, "
     "max_y REAL, max_z REAL, checksum INTEGER)",
     kFirstVersionWithJournal},
    {"table", "drive",
     "CREATE TABLE drive (id TEXT, name TEXT, part INTEGER, scans INTEGER, first_stamp INTEGER, last_stamp "
     "INTEGER, min_x REAL, min_y REAL, min_z REAL, max_x REAL, max_y REAL, max_z REAL, checksum INTEGER)"},
    {"table", "map",
     "CREATE TABLE map (resolution REAL, unit_exponent INTEGER, prior REAL, frame TEXT, class_table TEXT, "
     "parameters TEXT, program TEXT, checksum INTEGER)",
     1, 1},
    {"table", "map",
     "CREATE TABLE map (resolution REAL, unit_exponent INTEGER, prior REAL, frame TEXT, class_table TEXT, "
     "label_mask INTEGER, parameters TEXT, program TEXT, checksum INTEGER)",
     2},
    {"table", "scan",
     "CREATE TABLE scan (number INTEGER PRIMARY KEY, drive TEXT, stamp INTEGER, sensor TEXT, settings "
     "INTEGER, cleared INTEGER, jump INTEGER, reach REAL, pose BLOB, odometry BLOB, tiles BLOB, bytes "
     "INTEGER, content_checksum INTEGER, checksum INTEGER)",
     kFirstVersionWithJournal},
    // Apart from the rest of a scan, so that this can change without being written again.
    {"table", "scan_content", "CREATE TABLE scan_content (number INTEGER PRIMARY KEY, content BLOB)",
     kFirstVersionWithJournal},
    {"table", "settings",
     "CREATE TABLE settings (number INTEGER PRIMARY KEY, parameters TEXT, checksum INTEGER)",
     kFirstVersionWithJournal},
    {"table", "tile",
     "CREATE TABLE tile (part INTEGER, z INTEGER, y INTEGER, x INTEGER, blocks INTEGER, planes INTEGER, "
     "checksum INTEGER, content BLOB)"},
    {"index", "tile_list", "CREATE UNIQUE INDEX tile_list ON tile (part, z, y, x, blocks, planes, checksum)"},
    {"table", "total",
     "CREATE TABLE total (classes INTEGER, drives INTEGER, tiles INTEGER, blocks INTEGER, planes INTEGER, "
     "checksums INTEGER, checksum INTEGER)",
     1, kFirstVersionWithJournal - 1},
    {"table", "total",
     "CREATE TABLE total (classes INTEGER, drives INTEGER, tiles INTEGER, blocks INTEGER, planes INTEGER, "
     "scans INTEGER, settings INTEGER, cleared INTEGER, checksums INTEGER, checksum INTEGER)",
     kFirstVersionWithJournal},
};

constexpr char kMagic[] = "SQLite format 3";  // ends in a zero byte, in the file, too

// Positions in the header of an SQLite file (sqlite.org/fileformat.html).
constexpr std::size_t kPageSize = 16, kWriteFormat = 18, kReadFormat = 19, kPageCount = 28, kEncoding = 56,
                      kUserVersion = 60, kApplication = 68;

std::int64_t bigEndian(const Database::Header& header, std::size_t position, std::size_t bytes) {
  std::int64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | header[position + i];
  return value;
}

}  // namespace

void createSchema(Database& database) {
  database.run(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
  database.run(("PRAGMA user_version = " + std::to_string(kFormatVersion)).c_str());
  for (const SchemaEntry& entry : kSchema) {
    if (entry.isOf(kFormatVersion)) database.run(entry.sql);
  }
}

std::int64_t checkIdentity(const Database& database) {
  const Database::Header header = database.header();
  if (std::memcmp(header.data(), kMagic, sizeof kMagic) != 0 ||
      bigEndian(header, kApplication, 4) != kApplicationId) {
    throw notAMap(database.name());
  }
  const std::int64_t version = bigEndian(header, kUserVersion, 4);
  if (version > kFormatVersion) {
    throw MapFileError(database.name() + " was written by a newer version of bki_mapping (format " +
                       std::to_string(version) + ", this one knows formats up to " +
                       std::to_string(kFormatVersion) + "); use that version or a later one");
  }
  if (version < 1) throw damaged(database.name(), "its format is " + std::to_string(version));
  if (header[kWriteFormat] != 1 || header[kReadFormat] != 1 || bigEndian(header, kEncoding, 4) != 1) {
    throw damaged(database.name(), "its header is not that of a map");
  }
  return version;
}

void checkComplete(const Database& database) {
  const Database::Header header = database.header();
  const std::int64_t page = bigEndian(header, kPageSize, 2) == 1 ? 65536 : bigEndian(header, kPageSize, 2);
  const std::int64_t size = bigEndian(header, kPageCount, 4) * page;
  if (database.fileSize() < size) {
    throw damaged(database.name(),
                  "it has " + std::to_string(database.fileSize()) + " bytes of " + std::to_string(size));
  }
}

void checkSchema(const Database& database, std::int64_t version) {
  Statement select = database.prepare("SELECT type, name, sql FROM sqlite_master ORDER BY name");
  for (const SchemaEntry& entry : kSchema) {
    if (!entry.isOf(version)) continue;
    if (!select.step() || select.text(0) != entry.type || select.text(1) != entry.name ||
        select.text(2) != entry.sql) {
      throw damaged(database.name(), "its tables are not those of a map");
    }
  }
  if (select.step()) throw damaged(database.name(), "it has tables that do not belong to a map");
}

void changeSchema(Database& database, std::int64_t version) {
  for (const SchemaEntry& entry : kSchema) {
    if (entry.last == version - 1) database.run((std::string("DROP TABLE ") + entry.name).c_str());
    if (entry.first == version) database.run(entry.sql);
  }
}

}  // namespace bki_mapping
