#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "bki_mapping/store/map_file.h"
#include "core/atomic_file.h"
#include "store/database.h"
#include "store/map_file_state.h"
#include "store/records.h"
#include "store/schema.h"

namespace bki_mapping {
namespace {

/// Keeps others from opening a file that is about to be replaced. A journal that a killed process left is
/// applied first; otherwise SQLite would apply it to the new file.
std::optional<Database> lockReplaced(const std::string& path) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    Database old(path, Database::Mode::kUpdate);
    checkIdentity(old);
    old.lock();
    return old;
  } catch (const MapFileInUse&) {
    throw;
  } catch (const MapFileError&) {
    return std::nullopt;  // not a map, or a damaged one: replaced like any other file
  }
}

/// Removes files that SQLite would take for a part of a new file with this name. The removal is durable
/// before the new file appears.
void removeLeftovers(const std::string& path) {
  std::error_code ignored;
  const std::string target = std::filesystem::weakly_canonical(path, ignored).string();
  bool removed = false;
  for (const char* suffix : {"-journal", "-wal", "-shm"}) {
    removed |= std::filesystem::remove(target + suffix, ignored);
  }
  if (removed) syncFolder(target);
}

}  // namespace

const char* programName() {
  return "bki_mapping " BKI_MAPPING_VERSION;
}

struct NewMapFile::State {
  State(const std::string& file_path, const MapInfo& info, bool is_locked)
      : path(file_path), replaced(is_locked ? std::nullopt : lockReplaced(path)), atomic(path) {
    auto state = std::make_unique<MapFile::State>(atomic.temporaryPath(), Database::Mode::kNew, path);
    state->database.run("BEGIN");
    createSchema(state->database);
    state->totals.checksums +=
        writeMapRow(state->database, info, {info.classes->name(), info.classes->labelMask()});
    Statement insert = state->database.prepare("INSERT INTO class VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
    for (const SemanticClass& c : info.classes->classes()) {
      state->totals.checksums += writeClassRow(insert, state->totals.classes++, c);
    }
    writeTotals(state->database, kFormatVersion, state->totals);
    state->database.run("COMMIT");
    state->info = info;
    file = MapFile(std::move(state));
  }

  std::string path;
  std::optional<Database> replaced;
  AtomicFile atomic;
  MapFile file{std::unique_ptr<MapFile::State>()};
  std::optional<MapFile::Change> change;
};

NewMapFile::NewMapFile(const std::string& path, const MapInfo& given, const MapFile* replaced) {
  MapInfo info = given;
  info.program = programName();
  checkInfo(info);
  try {
    state_ = std::make_unique<State>(path, info, replaced != nullptr);
  } catch (const MapFileError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw MapFileError(error.what());
  }
  state_->change.emplace(state_->file.change());
}

NewMapFile::~NewMapFile() = default;

MapFile::Change& NewMapFile::content() {
  return *state_->change;
}

void NewMapFile::commit() {
  state_->change->commit();
  state_->change.reset();
  state_->file = MapFile(std::unique_ptr<MapFile::State>());
  try {
    removeLeftovers(state_->path);
    state_->atomic.commit();
  } catch (const std::runtime_error& error) {
    throw MapFileError(error.what());
  }
}

}  // namespace bki_mapping
