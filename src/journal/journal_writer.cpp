#include "journal/journal_writer.h"

#include <optional>
#include <stdexcept>

#include "journal/scan_codec.h"
#include "journal/stored_journal.h"
#include "journal/stored_settings.h"

namespace bki_mapping {
namespace {

/// Scans before a jump, by their stamps, that may come after scans behind it.
constexpr int kMostLate = 100;

/// Packs a scan when it is written, unless that has been done. One with too many points stays without
/// content, and cannot be moved.
std::function<std::string()> contentOf(const JournalScan& scan) {
  if (scan.packed) return [packed = scan.packed] { return *packed; };
  return [raw = scan.scan] {
    try {
      return packScan(*raw);
    } catch (const std::length_error&) {
      return std::string();
    }
  };
}

}  // namespace

JournalWriter::JournalWriter(const JournalSize& size, std::string drive,
                             std::shared_ptr<const ClassTable> classes)
    : first_number_(size.next_number),
      first_cleared_(size.cleared),
      next_settings_(size.settings),
      drive_(std::move(drive)),
      classes_(std::move(classes)) {}

void JournalWriter::reset(std::string drive) {
  drive_ = std::move(drive);
  first_cleared_ = next_settings_ = 0;
  settings_.clear();
  written_.clear();
  jumps_.clear();
  after_jumps_.clear();
}

int JournalWriter::numberOf(const std::shared_ptr<const MapperConfig>& settings, JournalChange& change) {
  for (const auto& [known, number] : settings_) {
    if (known == settings) return number;
  }
  change.settings.push_back(settingsText(*settings, *classes_));
  settings_.emplace_back(settings, next_settings_);
  return next_settings_++;
}

void JournalWriter::findJumps(const ScanJournal& journal, std::set<ScanJournal::Number>& changed) {
  for (const std::uint64_t jump : journal.jumps()) {
    if (jumps_.count(jump) > 0) continue;
    std::optional<ScanJournal::Number> first;  // after the jump, by its stamp
    int before = 0;
    for (auto number = written_.rbegin(); number != written_.rend() && before < kMostLate; ++number) {
      if (!journal.has(*number)) break;
      const std::uint64_t stamp = journal.at(*number).stamp;
      before += stamp < jump;
      if (stamp >= jump && (!first || stamp < journal.at(*first).stamp)) first = *number;
    }
    if (!first) continue;  // it is still to come
    jumps_.insert(jump);
    if (before > 0) after_jumps_.insert(*first);
    changed.insert(*first);
  }
}

JournalChange JournalWriter::take(MapCorrector& corrector, const std::vector<std::string>& sensors) {
  MapCorrector::Changes changes = corrector.takeChanges();
  const ScanJournal& journal = corrector.journal();
  JournalChange change;
  std::vector<ScanJournal::Number> added;
  for (const ScanJournal::Number number : changes.added) {
    if (!journal.has(number) || !journal.at(number).isKept()) continue;
    added.push_back(number);
    written_.insert(written_.end(), number);
  }
  findJumps(journal, changes.moved);
  const auto record = [&](ScanJournal::Number number) {
    const JournalScan& scan = journal.at(number);
    StoredAs stored;
    stored.number = fileNumber(number);
    stored.drive = drive_;
    if (scan.sensor < sensors.size()) stored.sensor = sensors[scan.sensor];
    stored.settings = numberOf(scan.settings, change);
    stored.first_cleared = first_cleared_;
    stored.jump = after_jumps_.count(number) > 0;
    return recordOf(scan, stored);
  };
  for (const ScanJournal::Number number : added) {
    change.added.push_back({record(number), contentOf(journal.at(number))});
    changes.moved.erase(number);
  }
  for (const ScanJournal::Number number : changes.moved) {
    if (journal.has(number) && written_.count(number) > 0) change.moved.push_back(record(number));
  }
  for (const ScanJournal::Number number : added) corrector.noteStored(number);
  return change;
}

}  // namespace bki_mapping
