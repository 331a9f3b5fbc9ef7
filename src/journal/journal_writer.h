/// @file Tells a map file what changes in the journal of its map.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/store/scan_record.h"
#include "journal/map_corrector.h"

namespace bki_mapping {

/// Numbers the scans and settings of a drive as rows of a map file. Not thread-safe.
class JournalWriter {
 public:
  /// @param size of the journal in the file, before the drive. @param drive DriveRecord::id. @param classes
  /// of the mapper.
  JournalWriter(const JournalSize& size, std::string drive, std::shared_ptr<const ClassTable> classes);

  /// The file was emptied; a drive begins.
  void reset(std::string drive);
  /// What has changed since the last call. Scans that could not be packed, or have been forgotten, are left
  /// out. @param sensors names of the sensors, by their numbers.
  JournalChange take(MapCorrector& corrector, const std::vector<std::string>& sensors);
  /// The number in the file of a scan of the corrector. May be called in any thread.
  std::uint64_t fileNumber(ScanJournal::Number number) const { return first_number_ + number; }

 private:
  /// The number of settings in the file; adds them to the change if it does not have them.
  int numberOf(const std::shared_ptr<const MapperConfig>& settings, JournalChange& change);
  /// Finds the scans after jumps that were noted since the last call, and adds them to those that changed.
  void findJumps(const ScanJournal& journal, std::set<ScanJournal::Number>& changed);

  const std::uint64_t first_number_;
  int first_cleared_, next_settings_;
  std::string drive_;
  std::shared_ptr<const ClassTable> classes_;
  std::vector<std::pair<std::shared_ptr<const MapperConfig>, int>> settings_;
  std::set<ScanJournal::Number> written_;      ///< scans that the file has
  std::set<std::uint64_t> jumps_;              ///< stamps of jumps that scans tell of [ns]
  std::set<ScanJournal::Number> after_jumps_;  ///< those scans
};

}  // namespace bki_mapping
