/// @file The rows of a map file's journal: scans, settings and cleared boxes.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "bki_mapping/store/scan_record.h"
#include "store/database.h"
#include "store/records.h"

namespace bki_mapping {

/// Adds all rows to `found`, which has none yet, and checks them, but for the content of scans. Stops one row
/// after those that are expected: then there are too many.
void readJournal(Database& database, const Totals& expected, Totals& found);

/// The scans, sorted by number.
std::vector<ScanRecord> readScans(Database& database);
/// The number above those of all scans.
std::uint64_t readNextNumber(Database& database);
/// The packed scan. @throws MapFileDamaged if its checksum is wrong, or there is no such scan.
std::string readScanContent(Database& database, std::uint64_t number);
/// Writes a scan that the table does not have, and adds it to the totals.
void insertScan(Database& database, const ScanRecord& scan, const std::string& content, Totals& totals);
/// Replaces all of a scan but its content. @throws std::invalid_argument if there is no such scan.
void updateScan(Database& database, const ScanRecord& scan, Totals& totals);

/// The settings, as YAML, by their numbers from 0.
std::vector<std::string> readSettings(Database& database);
void insertSettings(Database& database, const std::string& parameters, Totals& totals);
/// The boxes that were cleared, in order.
std::vector<Eigen::AlignedBox3d> readCleared(Database& database);
void insertCleared(Database& database, const Eigen::AlignedBox3d& box, Totals& totals);
/// Erases all rows of the journal.
void eraseJournal(Database& database, Totals& totals);

/// @throws std::invalid_argument in one sentence if a value is not allowed.
void checkScan(const ScanRecord& scan);

}  // namespace bki_mapping
