#include "journal/journal_output.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "bki_mapping/store/mapper_file.h"
#include "journal/stored_journal.h"
#include "journal/stored_settings.h"

namespace bki_mapping {
namespace {

bool areSame(const std::string& path, const std::string& other) {
  std::error_code missing;
  return std::filesystem::equivalent(path, other, missing);
}

/// The first scans after jumps of the recorded poses, by their stamps.
std::set<ScanJournal::Number> scansAfterJumps(const ScanJournal& journal) {
  std::map<std::uint64_t, ScanJournal::Number> by_stamp;
  for (ScanJournal::Number n = journal.begin(); n < journal.end(); ++n)
    by_stamp.emplace(journal.at(n).stamp, n);
  std::set<ScanJournal::Number> after;
  for (const std::uint64_t jump : journal.jumps()) {
    const auto first = by_stamp.lower_bound(jump);
    if (first != by_stamp.begin() && first != by_stamp.end()) after.insert(first->second);
  }
  return after;
}

/// Adds the scans of a drive behind those that the journal of the continued map has.
void addDrive(const JournalOutput& output, const ClassTable& classes, std::uint64_t first_number,
              int first_cleared, MapFile::Change& change) {
  const ScanJournal& journal = output.kept->corrector().journal();
  for (const Eigen::AlignedBox3d& box : output.kept->cleared()) change.addClearedBox(box);
  const std::set<ScanJournal::Number> after_jumps = scansAfterJumps(journal);
  std::map<std::shared_ptr<const MapperConfig>, int> settings;
  StoredAs stored;
  stored.drive = output.drive;
  stored.number = first_number;
  stored.first_cleared = first_cleared;
  for (ScanJournal::Number n = journal.begin(); n < journal.end(); ++n) {
    const JournalScan& scan = journal.at(n);
    if (!scan.packed) continue;
    const auto [known, is_new] = settings.emplace(scan.settings, 0);
    if (is_new) known->second = change.addSettings(settingsText(*scan.settings, classes));
    stored.settings = known->second;
    stored.sensor = output.kept->sensors()[scan.sensor];
    stored.jump = after_jumps.count(n) > 0;
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
  if (journal.kept) {
    const JournalSize before = journal.continued ? journal.continued->journalSize() : JournalSize();
    addDrive(journal, mapper.classes(), before.next_number, before.cleared, file.content());
  }
  file.commit();
}

}  // namespace bki_mapping
