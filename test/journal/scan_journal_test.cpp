// What a journal keeps in memory, with and without a map file.
#include "journal/scan_journal.h"

#include <gtest/gtest.h>

namespace bki_mapping {
namespace {

constexpr std::size_t kBytes = 100;  // of a packed scan

/// A scan that touches one region, whose x is its stamp.
JournalScan scanOf(int stamp) {
  JournalScan scan;
  scan.stamp = static_cast<std::uint64_t>(stamp);
  scan.scan = std::make_shared<const SensorScan>();
  scan.T_map_sensor = scan.T_odometry_sensor = Eigen::Isometry3d::Identity();
  scan.regions = {{stamp, 0, 0}};
  return scan;
}

/// Adds scans, and packs them.
void fill(ScanJournal& journal, int scans) {
  for (int n = 0; n < scans; ++n) {
    const ScanJournal::Number number = journal.add(scanOf(n));
    journal.setPacked(number, std::make_shared<const std::string>(kBytes, 'x'));
  }
}

TEST(ScanJournal, ForgetsTheOldestWithoutAFile) {
  ScanJournal journal(2 * kBytes + 50);
  fill(journal, 5);
  EXPECT_EQ(journal.forgotten(), 3u);
  EXPECT_EQ(journal.begin(), 3u);
  EXPECT_EQ(journal.bytes(), 2 * kBytes);
  EXPECT_EQ(journal.foreign(), (std::set<GridIndex>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}));
}

TEST(ScanJournal, LeavesTheOldestToAFile) {
  ScanJournal journal(2 * kBytes + 50, true);
  fill(journal, 4);
  EXPECT_EQ(journal.bytes(), 4 * kBytes) << "the file has none yet";
  EXPECT_EQ(journal.bytesNotStored(), 4 * kBytes);
  for (ScanJournal::Number number = 0; number < 3; ++number) journal.setStored(number);
  EXPECT_EQ(journal.bytes(), 2 * kBytes);
  EXPECT_EQ(journal.bytesNotStored(), kBytes);
  EXPECT_FALSE(journal.at(1).packed);
  EXPECT_TRUE(journal.at(1).isKept() && journal.at(2).packed);
  EXPECT_TRUE(journal.size() == 4 && journal.forgotten() == 0 && journal.foreign().empty());
}

TEST(ScanJournal, ForgetsWhatAFileDoesNotTakeAtTwiceTheLimit) {
  ScanJournal journal(2 * kBytes, true);
  fill(journal, 1);
  journal.setStored(0);
  for (int n = 1; n < 8; ++n) {
    journal.setPacked(journal.add(scanOf(n)), std::make_shared<const std::string>(kBytes, 'x'));
  }
  EXPECT_EQ(journal.bytes(), 4 * kBytes);
  EXPECT_EQ(journal.forgotten(), 3u);
  EXPECT_TRUE(journal.at(0).isKept()) << "the file has it";
  EXPECT_FALSE(journal.has(1) && journal.at(1).isKept());
  EXPECT_EQ(journal.foreign(), (std::set<GridIndex>{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}}));
}

TEST(ScanJournal, CountsNoBytesOfScansThatStayWhereTheyAre) {
  ScanJournal journal(10 * kBytes, true);
  fill(journal, 3);
  journal.leave(1);
  EXPECT_FALSE(journal.at(1).isKept());
  EXPECT_EQ(journal.bytes(), 2 * kBytes);
  EXPECT_EQ(journal.bytesNotStored(), 2 * kBytes);
  EXPECT_EQ(journal.foreign(), (std::set<GridIndex>{{1, 0, 0}}));
}

}  // namespace
}  // namespace bki_mapping
