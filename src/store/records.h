/// @file The rows of a map file's tables but that of tiles, each described once for writing, reading and
/// checksums.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "store/database.h"

namespace bki_mapping {

/// zlib's CRC-32 of a row's values: integers and real numbers as 8 bytes, little-endian; texts and blobs as
/// their length, an integer, followed by their bytes; NULL as nothing.
class RowChecksum {
 public:
  void add(std::int64_t value);
  void add(double value);
  void add(const std::string& value);
  std::uint32_t value() const { return value_; }

 private:
  std::uint32_t value_ = 0;
};

/// Binds the fields of a row, followed by the row's checksum.
class RowWriter {
 public:
  explicit RowWriter(Statement& statement) : statement_(statement) {}

  template <typename T>
  void operator()(const T& field) {
    if constexpr (std::is_integral_v<T>) {
      put(static_cast<std::int64_t>(field));
    } else {
      put(field);
    }
  }
  void operator()(const std::optional<double>& field) {
    if (field) return put(*field);
    statement_.bindNull(column_++);
  }
  /// @param bytes must stay until the statement has run.
  void blob(const std::string& bytes) {
    checksum_.add(bytes);
    statement_.bindBytes(column_++, bytes);
  }
  /// @return the checksum.
  std::uint32_t finish() {
    statement_.bind(column_, std::int64_t{checksum_.value()});
    return checksum_.value();
  }

 private:
  template <typename T>
  void put(const T& value) {
    checksum_.add(value);
    statement_.bind(column_++, value);
  }

  Statement& statement_;
  RowChecksum checksum_;
  int column_ = 0;
};

/// Reads the fields of a row, and checks the row's checksum, which follows them.
class RowReader {
 public:
  /// @param name of the file in errors.
  RowReader(const Statement& statement, const std::string& name) : statement_(statement), name_(name) {}

  template <typename T>
  void operator()(T& field) {
    if constexpr (std::is_integral_v<T>) {
      const std::int64_t value = statement_.integer(column_++);
      field = static_cast<T>(value);
      if (static_cast<std::int64_t>(field) != value || (std::is_unsigned_v<T> && value < 0)) {
        throw damaged(name_, "a number is out of range");
      }
      checksum_.add(value);
    } else if constexpr (std::is_floating_point_v<T>) {
      field = statement_.real(column_++);
      checksum_.add(field);
    } else {
      field = statement_.text(column_++);
      text_size_ += static_cast<std::int64_t>(field.size());
      checksum_.add(field);
    }
  }
  void operator()(std::optional<double>& field) {
    field.reset();
    if (statement_.isNull(column_)) {
      ++column_;
    } else {
      (*this)(field.emplace());
    }
  }
  void blob(std::string& bytes) {
    const Statement::Bytes found = statement_.bytes(column_++);
    bytes.assign(reinterpret_cast<const char*>(found.data), found.size);
    text_size_ += static_cast<std::int64_t>(found.size);
    checksum_.add(bytes);
  }
  /// @return the checksum. @throws MapFileError if it is wrong.
  std::uint32_t finish() const;
  /// The size of all texts and blobs of the row [bytes].
  std::int64_t textSize() const { return text_size_; }

 private:
  const Statement& statement_;
  const std::string& name_;
  RowChecksum checksum_;
  std::int64_t text_size_ = 0;
  int column_ = 0;
};

/// The number of rows of the other tables: without it, a lost row would go unnoticed.
struct Totals {
  std::int64_t classes = 0, drives = 0, tiles = 0, blocks = 0, planes = 0;
  std::int64_t scans = 0, settings = 0, cleared = 0;  ///< of the journal; 0 before kFirstVersionWithJournal
  /// Sum of the checksums of all rows of the other tables.
  std::int64_t checksums = 0;

  bool operator==(const Totals& o) const {
    return classes == o.classes && drives == o.drives && tiles == o.tiles && blocks == o.blocks &&
           planes == o.planes && scans == o.scans && settings == o.settings && cleared == o.cleared &&
           checksums == o.checksums;
  }
};

/// What the row of the map says of the class table.
struct TableRow {
  std::string name;
  std::uint32_t label_mask = ClassTable::kAllBits;  ///< files of version 1 have none
};

/// Each function reads or writes one row, with the columns in the order of the table. @return the checksum.
std::uint32_t writeMapRow(Database& database, const MapInfo& info, const TableRow& table);
/// @param version of the file.
std::uint32_t readMapRow(Database& database, std::int64_t version, MapInfo& info, TableRow& table);
std::uint32_t writeClassRow(Statement& insert, std::int64_t position, const SemanticClass& c);
std::uint32_t writeDriveRow(Statement& insert, const DriveRecord& drive);
/// @param version of the file.
void writeTotals(Database& database, std::int64_t version, const Totals& totals);
Totals readTotals(Database& database, std::int64_t version);

/// All rows of a table, sorted by position or id. @param expected the number of rows, if it is known.
/// @param[in,out] checksums the checksums of the rows are added to it.
/// @throws MapFileDamaged if the table has another number of rows, or a row is not valid.
std::vector<SemanticClass> readClasses(Database& database, std::int64_t expected, std::int64_t& checksums);
std::vector<DriveRecord> readDrives(Database& database, std::optional<std::int64_t> expected,
                                    std::int64_t& checksums);

/// @throws std::invalid_argument in one sentence if a value is not allowed.
void checkInfo(const MapInfo& info);
void checkDrive(const DriveRecord& drive);
/// @param what begins the sentence.
void checkText(const std::string& what, const std::string& text);

}  // namespace bki_mapping
