#include "store/database.h"

#include <sqlite3.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <utility>

#include "core/atomic_file.h"

namespace bki_mapping {
namespace {

/// SQLite reports the steps of its virtual machine in portions of this size.
constexpr int kStepsAtOnce = 1000;
/// A row takes more than 60 bytes, with that of its index, and less than 30 steps to be read.
constexpr double kStepsPerByte = 0.5;
/// SQLite keeps up to 2 MB of a change in memory.
constexpr std::int64_t kMostUnwritten = 4'000'000;

constexpr int kLargestValue = 300'000'000;  ///< larger than the largest tile [bytes]
constexpr std::size_t kLongestQuote = 300;
constexpr char kBusy[] = " is open in another place; close it there, or work on a copy of the file";

constexpr char kOtherName[] = "give the name of a .bkm file";

bool endsAsAMap(const std::string& path) {
  return std::filesystem::path(path).extension() == ".bkm";
}

/// Whether memory is available although SQLite reports a shortage, as it also does for impossible lengths.
bool canAllocate(std::size_t bytes) {
  void* const memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return false;
  munmap(memory, bytes);
  return true;
}

[[noreturn]] void fail(const std::string& path, sqlite3* database, int code) {
  const int system_error = database ? sqlite3_system_errno(database) : 0;
  const std::string reason = system_error ? std::strerror(system_error) : sqlite3_errstr(code);
  switch (code & 0xff) {
    case SQLITE_NOMEM:
      if (canAllocate(kLargestValue)) throw damaged(path, "a length is wrong");
      throw std::bad_alloc();
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw MapFileInUse(path + kBusy);
    case SQLITE_INTERRUPT:
      throw damaged(path, "its pages contain each other");
    case SQLITE_NOTADB:
      throw notAMap(path);
    case SQLITE_CANTOPEN:
      throw MapFileError(path + " cannot be opened: " + reason + "; check name and rights");
    case SQLITE_FULL:
      throw MapFileError(writeFailure(path, "the disk is full").what());
    case SQLITE_READONLY:
      throw MapFileError(writeFailure(path, "it is read-only").what());
    case SQLITE_IOERR:
      if (code == SQLITE_IOERR_READ || code == SQLITE_IOERR_SHORT_READ) {
        throw MapFileError(path + " cannot be read: " + reason + "; check the disk");
      }
      throw MapFileError(writeFailure(path, reason).what());
    default:
      throw damaged(path, database ? sqlite3_errmsg(database) : sqlite3_errstr(code));
  }
}

sqlite3_file* fileOf(sqlite3* database) {
  sqlite3_file* file = nullptr;
  sqlite3_file_control(database, "main", SQLITE_FCNTL_FILE_POINTER, &file);
  return file;
}

/// Configures SQLite for files from strangers, as sqlite.org/security.html recommends.
void distrust(sqlite3* database) {
  constexpr std::pair<int, int> kSettings[] = {{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                               {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                               {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                               {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                               {SQLITE_DBCONFIG_DQS_DDL, 0},
                                               {SQLITE_DBCONFIG_DQS_DML, 0},
                                               {SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0}};
  for (const auto& [setting, value] : kSettings) {
    sqlite3_db_config(database, setting, value, static_cast<int*>(nullptr));
  }
  constexpr std::pair<int, int> kLimits[] = {{SQLITE_LIMIT_LENGTH, kLargestValue},
                                             {SQLITE_LIMIT_SQL_LENGTH, 4096},
                                             {SQLITE_LIMIT_COLUMN, 32},
                                             {SQLITE_LIMIT_EXPR_DEPTH, 20},
                                             {SQLITE_LIMIT_COMPOUND_SELECT, 3},
                                             {SQLITE_LIMIT_VDBE_OP, 25'000},
                                             {SQLITE_LIMIT_FUNCTION_ARG, 8},
                                             {SQLITE_LIMIT_ATTACHED, 0},
                                             {SQLITE_LIMIT_LIKE_PATTERN_LENGTH, 50},
                                             {SQLITE_LIMIT_VARIABLE_NUMBER, 32},
                                             {SQLITE_LIMIT_TRIGGER_DEPTH, 1},
                                             {SQLITE_LIMIT_WORKER_THREADS, 0}};
  for (const auto& [limit, value] : kLimits) sqlite3_limit(database, limit, value);
}

}  // namespace

MapFileDamaged damaged(const std::string& path, const std::string& what) {
  // The text may quote the file, so it is cut, and freed of characters that a terminal would obey.
  std::string quoted = what.substr(0, kLongestQuote);
  for (char& c : quoted) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '?';
  }
  return MapFileDamaged(path + " is damaged (" + quoted + "); use another copy of it");
}

MapFileError notAMap(const std::string& path) {
  const std::string is = path + " is not a map of bki_mapping";
  return MapFileError(endsAsAMap(path) ? is + ", although its name ends in .bkm; use another copy of it"
                                       : is + "; " + kOtherName);
}

void Database::Close::operator()(sqlite3* database) const {
  sqlite3_close_v2(database);
}

Database::Database(const std::string& path, Mode mode, const std::string& name)
    : name_(name), mode_(mode), work_(std::make_unique<Work>()) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    throw MapFileError(name_ + " is not a regular file; " + kOtherName);
  }
  if (mode != Mode::kNew && S_ISREG(status.st_mode) && status.st_size == 0) {
    throw MapFileError(name_ + " is empty; " +
                       (endsAsAMap(name_) ? "use another copy of it, or make the map again" : kOtherName));
  }
  sqlite3* opened = nullptr;
  // An absolute path has no special meaning to SQLite; "file:x" and ":memory:" do.
  const std::string absolute = std::filesystem::absolute(path).string();
  const int code = sqlite3_open_v2(absolute.c_str(), &opened, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX,
                                   mode == Mode::kNew ? "unix-none" : nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) fail(name_, opened, code);
  sqlite3_extended_result_codes(opened, 1);
  harden();
}

void Database::harden() {
  const auto count = [](void* work) {
    return static_cast<int>((static_cast<Work*>(work)->steps -= kStepsAtOnce) < 0);
  };
  sqlite3_progress_handler(database_.get(), kStepsAtOnce, count, work_.get());
  run("PRAGMA mmap_size = 0");
  run("PRAGMA temp_store = MEMORY");
  if (mode_ == Mode::kNew) {  // SQLite's defences would keep the journal on
    run("PRAGMA journal_mode = OFF");
    run("PRAGMA synchronous = OFF");
  }
  distrust(database_.get());
  run("PRAGMA cell_size_check = ON");
  if (mode_ == Mode::kRead) run("PRAGMA query_only = ON");
}

void Database::lock() {
  if (mode_ == Mode::kUpdate) {
    // SQLite would not report it before the first write.
    const char* const file = sqlite3_db_filename(database_.get(), "main");
    if (access(file, W_OK) != 0 || access(std::filesystem::path(file).parent_path().c_str(), W_OK) != 0) {
      throw MapFileError(writeFailure(name_, std::strerror(errno)).what());
    }
    run("PRAGMA locking_mode = EXCLUSIVE");
    run("PRAGMA synchronous = EXTRA");
    run("BEGIN EXCLUSIVE");
    run("COMMIT");
  } else {
    run("BEGIN");
    run("PRAGMA schema_version");
  }
}

void Database::limitWork() const {
  work_->steps = static_cast<std::int64_t>(kStepsPerByte * static_cast<double>(mostContent()));
}

Database::Header Database::header() const {
  Header header{};
  sqlite3_file* const file = fileOf(database_.get());
  const int code = file->pMethods->xRead(file, header.data(), static_cast<int>(header.size()), 0);
  if (code == SQLITE_IOERR_SHORT_READ) fail(name_, nullptr, SQLITE_NOTADB);
  if (code != SQLITE_OK) fail(name_, database_.get(), code);
  return header;
}

std::int64_t Database::fileSize() const {
  sqlite3_file* const file = fileOf(database_.get());
  sqlite3_int64 size = 0;
  const int code = file->pMethods->xFileSize(file, &size);
  if (code != SQLITE_OK) fail(name_, database_.get(), code);
  return size;
}

std::int64_t Database::mostContent() const {
  return fileSize() + kMostUnwritten;
}

Statement Database::prepare(const char* sql) const {
  limitWork();
  return {name_, database_.get(), sql};
}

void Database::run(const char* sql) {
  limitWork();
  const int code = sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(name_, database_.get(), code);
}

bool Database::inTransaction() const {
  return sqlite3_get_autocommit(database_.get()) == 0;
}

void Database::rollBack() noexcept {
  if (inTransaction()) {
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

void Database::copyTo(Database& other) const {
  sqlite3* const to = other.database_.get();
  sqlite3_backup* const copying = sqlite3_backup_init(to, "main", database_.get(), "main");
  if (!copying) fail(other.name_, to, sqlite3_extended_errcode(to));
  constexpr int kAllPages = -1;
  const int code = sqlite3_backup_step(copying, kAllPages);
  sqlite3_backup_finish(copying);
  if (code != SQLITE_DONE) fail(other.name_, to, code);
}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

Statement::Statement(const std::string& path, sqlite3* database, const char* sql)
    : path_(path), database_(database) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
  statement_.reset(statement);
  check(code);
}

void Statement::check(int code) const {
  if (code != SQLITE_OK) fail(path_, database_, code);
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) fail(path_, database_, code);
  return false;
}

void Statement::reset() noexcept {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

void Statement::bind(int parameter, std::int64_t value) {
  check(sqlite3_bind_int64(statement_.get(), parameter + 1, value));
}

void Statement::bind(int parameter, double value) {
  check(sqlite3_bind_double(statement_.get(), parameter + 1, value));
}

void Statement::bind(int parameter, const std::string& value) {
  check(sqlite3_bind_text64(statement_.get(), parameter + 1, value.data(), value.size(), SQLITE_TRANSIENT,
                            SQLITE_UTF8));
}

void Statement::bindNull(int parameter) {
  check(sqlite3_bind_null(statement_.get(), parameter + 1));
}

void Statement::bindBytes(int parameter, const std::string& bytes) {
  check(sqlite3_bind_blob64(statement_.get(), parameter + 1, bytes.data(), bytes.size(), SQLITE_STATIC));
}

std::int64_t Statement::integer(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_INTEGER) {
    throw damaged(path_, "a value is not an integer");
  }
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_FLOAT) {
    throw damaged(path_, "a value is not a real number");
  }
  return sqlite3_column_double(statement_.get(), column);
}

std::string Statement::text(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_TEXT) {
    throw damaged(path_, "a value is not a text");
  }
  const auto* const text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (!text) throw std::bad_alloc();
  return {text, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

bool Statement::isNull(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

Statement::Bytes Statement::bytes(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_BLOB) {
    throw damaged(path_, "a value is not a blob");
  }
  const auto* const data = static_cast<const unsigned char*>(sqlite3_column_blob(statement_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  if (!data && size > 0) throw std::bad_alloc();
  return {data, size};
}

}  // namespace bki_mapping
