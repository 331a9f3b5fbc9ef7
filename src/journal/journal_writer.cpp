#include "journal/journal_writer.h"

#include <algorithm>
#include <stdexcept>

#include "bki_mapping/settings/yaml.h"
#include "journal/scan_codec.h"
#include "journal/stored_journal.h"

namespace bki_mapping {
namespace {

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

JournalWriter::JournalWriter(const JournalSize& size, std::string drive)
    : first_number_(size.next_number),
      first_cleared_(size.cleared),
      next_settings_(size.settings),
      drive_(std::move(drive)) {}

void JournalWriter::reset(std::string drive) {
  drive_ = std::move(drive);
  first_cleared_ = next_settings_ = 0;
  settings_.clear();
  last_stamp_.reset();
  written_.clear();
  jumps_.clear();
}

int JournalWriter::numberOf(const std::shared_ptr<const MapperConfig>& settings, JournalChange& change) {
  for (const auto& [known, number] : settings_) {
    if (known == settings) return number;
  }
  change.settings.push_back(parameterYaml(*settings));
  settings_.emplace_back(settings, next_settings_);
  return next_settings_++;
}

bool JournalWriter::jumpsBefore(const ScanJournal& journal, std::uint64_t stamp) {
  bool jump = false;
  if (last_stamp_) {
    const auto next = journal.jumps().upper_bound(*last_stamp_);
    jump = next != journal.jumps().end() && *next <= stamp;
  }
  last_stamp_ = std::max(stamp, last_stamp_.value_or(0));
  return jump;
}

JournalChange JournalWriter::take(MapCorrector& corrector, const std::vector<std::string>& sensors) {
  const MapCorrector::Changes changes = corrector.takeChanges();
  const ScanJournal& journal = corrector.journal();
  JournalChange change;
  const auto record = [&](ScanJournal::Number number, bool jump) {
    const JournalScan& scan = journal.at(number);
    StoredAs stored;
    stored.number = fileNumber(number);
    stored.drive = drive_;
    if (scan.sensor < sensors.size()) stored.sensor = sensors[scan.sensor];
    stored.settings = numberOf(scan.settings, change);
    stored.first_cleared = first_cleared_;
    stored.jump = jump;
    return recordOf(scan, stored);
  };
  for (const ScanJournal::Number number : changes.added) {
    if (!journal.has(number) || !journal.at(number).isKept()) continue;
    const bool jump = jumpsBefore(journal, journal.at(number).stamp);
    change.added.push_back({record(number, jump), contentOf(journal.at(number))});
    written_.insert(written_.end(), number);
    corrector.noteStored(number);
    if (jump) jumps_.insert(number);
  }
  for (const ScanJournal::Number number : changes.moved) {
    if (!journal.has(number) || written_.count(number) == 0) continue;
    change.moved.push_back(record(number, jumps_.count(number) > 0));
  }
  return change;
}

}  // namespace bki_mapping
