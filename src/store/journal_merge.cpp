#include "store/journal_merge.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace bki_mapping {
namespace {

/// The scans of a drive in a file.
struct DriveScans {
  MapFile* file = nullptr;
  std::vector<ScanRecord> scans;

  bool isBefore(const DriveScans& other) const {
    return std::tuple(other.scans.size(), file->path()) < std::tuple(scans.size(), other.file->path());
  }
};
using ScansByDrive = std::map<std::string, DriveScans>;

ScansByDrive journalScansOf(const JournalSource& source) {
  ScansByDrive drives;
  if (!source.file->hasJournal()) return drives;
  for (ScanRecord& scan : source.file->scans()) {
    if (source.drives.count(scan.drive) == 0) continue;
    DriveScans& of_drive = drives[scan.drive];
    of_drive.file = source.file;
    of_drive.scans.push_back(std::move(scan));
  }
  return drives;
}

/// Writes the scans, numbered anew.
void writeScans(const ScansByDrive& drives, MapFile::Change& merged) {
  std::map<const MapFile*, std::vector<std::string>> settings;
  std::map<std::string, int> numbers;  // of the settings in the result
  const MapFile* with_boxes = nullptr;
  int boxes = 0;
  for (const auto& [id, drive] : drives) {
    if (!settings.emplace(drive.file, drive.file->settings()).second) continue;
    for (const Eigen::AlignedBox3d& box : drive.file->clearedBoxes()) {
      with_boxes = drive.file;
      boxes = merged.addClearedBox(box);
    }
  }
  std::uint64_t next = 0;
  for (const auto& [id, drive] : drives) {
    for (ScanRecord scan : drive.scans) {
      const std::string content = drive.file->scanContent(scan.number);
      const std::string& text = settings.at(drive.file).at(static_cast<std::size_t>(scan.settings));
      const auto [known, is_new] = numbers.emplace(text, 0);
      if (is_new) known->second = merged.addSettings(text);
      scan.settings = known->second;
      scan.number = next++;
      if (drive.file != with_boxes) scan.cleared = boxes;
      merged.addScan(scan, content);
    }
  }
}

}  // namespace

std::vector<std::string> mergeJournals(const std::vector<JournalSource>& sources, MapFile::Change& merged) {
  const auto isCleared = [](const JournalSource& source) {
    return source.obstacle.empty() && source.file->hasJournal() && !source.file->clearedBoxes().empty();
  };
  const bool many_are_cleared = std::count_if(sources.begin(), sources.end(), isCleared) > 1;
  ScansByDrive chosen;
  std::map<std::string, std::string> sentences;  // by path
  for (const JournalSource& source : sources) {
    ScansByDrive drives = journalScansOf(source);
    if (drives.empty()) continue;
    const std::string obstacle =
        many_are_cleared && isCleared(source) ? "boxes were cleared in several maps" : source.obstacle;
    if (!obstacle.empty()) {
      sentences[source.file->path()] =
          source.file->path() + " has scans in its journal, which the merged map does not have, because " +
          obstacle + "; correct their poses before you merge";
      continue;
    }
    for (auto& [id, drive] : drives) {
      const auto [known, is_new] = chosen.try_emplace(id, drive);
      if (!is_new && drive.isBefore(known->second)) known->second = std::move(drive);
    }
  }
  writeScans(chosen, merged);
  std::vector<std::string> list;
  for (const auto& [path, sentence] : sentences) list.push_back(sentence);
  return list;
}

}  // namespace bki_mapping
