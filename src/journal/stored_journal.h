/// @file The journal of a map file: scans of a MapCorrector as rows, and back.
#pragma once

#include <cstdint>
#include <string>

#include "bki_mapping/store/scan_record.h"
#include "journal/scan_journal.h"

namespace bki_mapping {

/// What a row says of a scan that the scan in memory does not know.
struct StoredAs {
  std::uint64_t number = 0;  ///< in the file
  std::string drive, sensor;
  int settings = 0;       ///< number in the file
  int first_cleared = 0;  ///< number in the file of the first box that the journal in memory knows
  bool jump = false;
};

/// The row of a scan where it is in the map now.
ScanRecord recordOf(const JournalScan& scan, const StoredAs& stored);

}  // namespace bki_mapping
