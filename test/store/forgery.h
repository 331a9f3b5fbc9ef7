/// @file Map files that somebody made in order to do harm.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "store/records.h"

namespace bki_mapping {

/// A file in the hands of somebody who knows SQLite.
class Forgery {
 public:
  explicit Forgery(const std::string& path) {
    sqlite3_open(path.c_str(), &database_);
    run("PRAGMA journal_mode = OFF");
    run("PRAGMA synchronous = OFF");
  }
  ~Forgery() { sqlite3_close(database_); }
  Forgery(const Forgery&) = delete;
  Forgery& operator=(const Forgery&) = delete;

  /// @return whether there is no error.
  bool run(const std::string& sql) {
    return sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
  }
  std::int64_t number(const std::string& sql) {
    std::int64_t value = 0;
    forEachRow(sql, [&](sqlite3_stmt* row) { value = sqlite3_column_int64(row, 0); });
    return value;
  }
  /// Makes all checksums of rows and all totals right.
  void sign() {
    std::int64_t sum = 0;
    const std::pair<const char*, std::string> kTables[] = {
        {"*", "map"},
        {"*", "class"},
        {"*", "drive"},
        {"*", "settings"},
        {"*", "cleared"},
        {"number, drive, stamp, sensor, settings, cleared, jump, reach, pose, odometry, tiles, bytes, "
         "content_checksum, checksum",
         "scan"}};
    for (const auto& [all_columns, table] : kTables) {
      std::vector<std::pair<std::int64_t, std::uint32_t>> checksums;
      forEachRow(std::string("SELECT ") + all_columns + ", rowid FROM " + table, [&](sqlite3_stmt* row) {
        const int columns = sqlite3_column_count(row);
        checksums.emplace_back(sqlite3_column_int64(row, columns - 1), checksumOf(row, columns - 2));
        sum += checksums.back().second;
      });
      for (const auto& [row, checksum] : checksums) {
        run("UPDATE " + table + " SET checksum = " + std::to_string(checksum) +
            " WHERE rowid = " + std::to_string(row));
      }
    }
    forEachRow("SELECT part, z, y, x, blocks, planes, checksum FROM tile",
               [&](sqlite3_stmt* row) { sum += checksumOf(row, 7); });
    run("UPDATE total SET classes = (SELECT count(*) FROM class), drives = (SELECT count(*) FROM drive), "
        "tiles = (SELECT count(*) FROM tile), blocks = (SELECT sum(blocks) FROM tile), "
        "planes = (SELECT sum(planes) FROM tile), scans = (SELECT count(*) FROM scan), "
        "settings = (SELECT count(*) FROM settings), cleared = (SELECT count(*) FROM cleared), checksums = " +
        std::to_string(sum));
    signTotals();
  }
  void signTotals() {
    std::uint32_t checksum = 0;
    forEachRow("SELECT * FROM total", [&](sqlite3_stmt* row) { checksum = checksumOf(row, 9); });
    run("UPDATE total SET checksum = " + std::to_string(checksum));
  }

 private:
  void forEachRow(const std::string& sql, const std::function<void(sqlite3_stmt*)>& visit) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      throw std::runtime_error(sql + ": " + sqlite3_errmsg(database_));
    }
    while (sqlite3_step(statement) == SQLITE_ROW) visit(statement);
    sqlite3_finalize(statement);
  }
  static std::uint32_t checksumOf(sqlite3_stmt* row, int columns) {
    RowChecksum checksum;
    for (int c = 0; c < columns; ++c) {
      switch (sqlite3_column_type(row, c)) {
        case SQLITE_INTEGER:
          checksum.add(std::int64_t{sqlite3_column_int64(row, c)});
          break;
        case SQLITE_FLOAT:
          checksum.add(sqlite3_column_double(row, c));
          break;
        case SQLITE_TEXT:
        case SQLITE_BLOB:
          checksum.add(std::string(static_cast<const char*>(sqlite3_column_blob(row, c)),
                                   static_cast<std::size_t>(sqlite3_column_bytes(row, c))));
          break;
        default:
          break;
      }
    }
    return checksum.value();
  }

  sqlite3* database_ = nullptr;
};

}  // namespace bki_mapping
