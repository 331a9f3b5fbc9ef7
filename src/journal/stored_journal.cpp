#include "journal/stored_journal.h"

namespace bki_mapping {

ScanRecord recordOf(const JournalScan& scan, const StoredAs& stored) {
  ScanRecord record;
  record.number = stored.number;
  record.drive = stored.drive;
  record.stamp = scan.stamp;
  record.sensor = stored.sensor;
  record.settings = stored.settings;
  record.cleared = stored.first_cleared + static_cast<int>(scan.cleared_before);
  record.jump = stored.jump;
  record.reach = scan.reach;
  record.T_map_sensor = scan.T_map_sensor;
  record.T_odometry_sensor = scan.T_odometry_sensor;
  record.tiles = scan.regions;
  return record;
}

}  // namespace bki_mapping
