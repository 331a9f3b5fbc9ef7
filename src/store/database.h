/// @file SQLite, hardened against hostile files, with errors in one sentence.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "bki_mapping/store/map_file.h"

struct sqlite3;
struct sqlite3_stmt;

namespace bki_mapping {

/// A prepared statement. Columns and parameters are counted from 0.
class Statement {
 public:
  /// Runs to the next row. @return false after the last one. @throws MapFileError.
  bool step();
  /// Prepares the statement to run again, with all parameters unbound.
  void reset() noexcept;

  void bind(int parameter, std::int64_t value);
  void bind(int parameter, double value);
  void bind(int parameter, const std::string& value);
  void bindNull(int parameter);
  /// @param bytes must stay until the next reset().
  void bindBytes(int parameter, const std::string& bytes);

  // Values of the current row. @throws MapFileDamaged if the value has another type.
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  bool isNull(int column) const;
  /// A view that is valid until the next step() or reset().
  struct Bytes {
    const unsigned char* data;
    std::size_t size;
  };
  Bytes bytes(int column) const;

 private:
  friend class Database;
  Statement(const std::string& path, sqlite3* database, const char* sql);
  void check(int code) const;

  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::string path_;
  sqlite3* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// An SQLite database whose content is not trusted.
class Database {
 public:
  enum class Mode {
    kRead,    ///< any number of databases may read a file
    kUpdate,  ///< this database has the file for itself; changes are durable
    kNew,     ///< an existing file that no other process knows: without locks, journal and syncing
  };
  /// The first 100 bytes of the file.
  using Header = std::array<unsigned char, 100>;

  /// Opens a file without reading from it. @param name of the file in errors. @throws MapFileError.
  Database(const std::string& path, Mode mode, const std::string& name);
  /// The same, with the path as the name.
  Database(const std::string& path, Mode mode) : Database(path, mode, path) {}

  /// Takes the lock of the mode, and keeps it as long as the file is open (with kRead, by a transaction that
  /// never ends). If a process was killed in the middle of a change, the change is undone.
  /// @throws MapFileError; MapFileInUse if the file is locked elsewhere.
  void lock();

  const std::string& name() const { return name_; }
  Mode mode() const { return mode_; }
  /// @throws MapFileError if the file is shorter.
  Header header() const;
  std::int64_t fileSize() const;
  /// An upper bound for the bytes in all rows of a sound database, including rows of a change that has not
  /// been written yet.
  std::int64_t mostContent() const;
  /// Runs a statement and ignores its rows.
  void run(const char* sql);
  Statement prepare(const char* sql) const;
  /// Whether a transaction is open. After some errors, also of reading, SQLite has rolled it back.
  bool inTransaction() const;
  /// Rolls an open transaction back, if there is one.
  void rollBack() noexcept;
  /// Copies all pages to an empty database. @throws MapFileError.
  void copyTo(Database& other) const;

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  /// How much a statement may still compute.
  struct Work {
    std::int64_t steps;
  };
  void harden();
  /// Limits the next statement to the number of steps that it can need in a sound file of this size. In a
  /// hostile file, pages that contain each other would keep SQLite busy for ever.
  void limitWork() const;

  std::string name_;
  Mode mode_;
  std::unique_ptr<Work> work_;  // SQLite has its address
  std::unique_ptr<sqlite3, Close> database_;
};

/// "PATH is damaged (WHAT); use another copy of it"
MapFileDamaged damaged(const std::string& path, const std::string& what);
/// The error for a file of another format.
MapFileError notAMap(const std::string& path);

}  // namespace bki_mapping
