#include "tools/journal_output.h"

#include <filesystem>
#include <utility>

#include "bki_mapping/store/mapper_file.h"
#include "journal/stored_journal.h"
#include "journal/stored_settings.h"

namespace bki_mapping::tools {
namespace {

bool areSame(const std::string& path, const std::string& other) {
  std::error_code missing;
  return std::filesystem::equivalent(path, other, missing);
}

/// Adds the scans of a drive behind those that the journal of the continued map has.
void addDrive(const MapCorrector& corrector, const std::string& drive, const std::string& settings,
              std::optional<MapFile>& continued, MapFile::Change& change) {
  const ScanJournal& journal = corrector.journal();
  if (journal.size() == 0) return;
  StoredAs stored;
  stored.drive = drive;
  stored.settings = change.addSettings(settings);
  if (continued) {
    stored.number = continued->scans().back().number + 1;
    stored.first_cleared = static_cast<int>(continued->clearedBoxes().size());
  }
  for (ScanJournal::Number n = journal.begin(); n < journal.end(); ++n) {
    const JournalScan& scan = journal.at(n);
    if (!scan.packed) continue;
    change.addScan(recordOf(scan, stored), *scan.packed);
    ++stored.number;
  }
}

}  // namespace

std::optional<MapFile> withJournal(const std::string& path, const std::string& output) {
  if (MapFile(path, MapFile::Access::kRead).scans().empty()) return std::nullopt;
  return MapFile(path, areSame(path, output) ? MapFile::Access::kUpdate : MapFile::Access::kRead);
}

void saveWithJournal(const std::string& path, const SemanticMapper& mapper, const std::string& frame,
                     const std::vector<DriveRecord>& drives, JournalOutput journal) {
  const MapFile* const replaced =
      journal.continued && areSame(path, journal.continued->path()) ? &*journal.continued : nullptr;
  NewMapFile file(path, mapInfoOf(mapper, frame), replaced);
  for (const DriveRecord& drive : drives) file.content().putDrive(drive);
  for (const GridIndex& tile : tilesOf(mapper.map())) file.content().writeTile(mapper.map(), {tile});
  if (journal.continued) copyJournal(*journal.continued, file.content());
  if (journal.corrector) {
    addDrive(*journal.corrector, journal.drive, settingsText(mapper.config(), mapper.classes()),
             journal.continued, file.content());
  }
  file.commit();
}

}  // namespace bki_mapping::tools
