// Files of all versions open for ever. What test/store/data/version_N.bkm holds was computed from the
// formulas in example_map.h by a program that shares no code with this one; test/store/read_map_test.py
// compares the same numbers.
#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "bki_mapping/store/map_file.h"
#include "reference/content.h"
#include "store/example_map.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "store/schema.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

class Version : public testing::TestWithParam<int> {
 protected:
  std::string file_ =
      BKI_MAPPING_SOURCE_DIR "/test/store/data/version_" + std::to_string(GetParam()) + ".bkm";
};
INSTANTIATE_TEST_SUITE_P(All, Version, testing::Range(1, static_cast<int>(kFormatVersion) + 1));

/// CRC-32 over all planes in the order of block (x, then y, then z) and class: x, y, z, class and the units,
/// 4 bytes each, little-endian.
uLong checksumOf(const SemanticMap& map) {
  std::map<std::array<std::int32_t, 4>, const EvidenceUnits*> planes;
  for (const auto& [index, block] : map.entries()) {
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      planes[{index.x, index.y, index.z, block->classes()[p]}] = block->plane(p);
    }
  }
  uLong sum = 0;
  for (const auto& [key, units] : planes) {
    sum = crc32(sum, reinterpret_cast<const Bytef*>(key.data()), sizeof key);
    sum = crc32(sum, reinterpret_cast<const Bytef*>(units), kBlockVoxels * sizeof(EvidenceUnits));
  }
  return sum;
}

/// CRC-32 over all looks of a block: begin (8 bytes), level (4 bytes) and the sight of each voxel (1 byte).
uLong checksumOf(const Looks& looks) {
  uLong sum = 0;
  for (const Look& look : looks.all()) {
    const std::uint64_t begin = look.begin();
    const std::uint32_t level = look.level();
    sum = crc32(sum, reinterpret_cast<const Bytef*>(&begin), sizeof begin);
    sum = crc32(sum, reinterpret_cast<const Bytef*>(&level), sizeof level);
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      const auto sight = static_cast<Bytef>(look.at(v));
      sum = crc32(sum, &sight, 1);
    }
  }
  return sum;
}

EvidenceUnits unitsAt(const SemanticMap& map, const BlockIndex& block, ClassId id, std::size_t voxel) {
  return map.find(block)->evidence(id)[voxel];
}

TEST_P(Version, HoldsItsEvidence) {
  MapFile file(file_, MapFile::Access::kRead);
  const SemanticMap map = readPart(file, 0), part = readPart(file, 1);
  EXPECT_EQ(map.size(), GetParam() < 6 ? 5u : 8u);
  EXPECT_EQ(checksumOf(map), GetParam() < 6 ? 0x5f49333bu : 0x81f7b573u);
  if (GetParam() >= 6) {
    EXPECT_EQ(unitsAt(map, {{2, 0, 0}}, kFreeClass, 500), 2 * 38339 + 3 * 98 + 500 % 98);
    EXPECT_EQ(unitsAt(map, {{2, 5, 0}}, kFreeClass, 500), 1 * 38339 + 1 * 98 + 500 % 98);
    EXPECT_EQ(unitsAt(map, {{-2, -1, -1}}, 40, 504), 400 * 1278 + 504);
  }
  EXPECT_EQ(unitsAt(map, {{0, 0, 0}}, 40, 2), 2);
  EXPECT_EQ(unitsAt(map, {{0, 0, 0}}, 40, 3), 2147483647);
  EXPECT_EQ(unitsAt(map, {{-1, -1, -1}}, kFreeClass, 511), -2147483647);
  EXPECT_EQ(unitsAt(map, {{1, 0, 0}}, 0, 100), -1);
  EXPECT_EQ(unitsAt(map, {{7, 7, 7}}, 253, 1), 333336240);
  EXPECT_EQ(part.size(), 2u);
  EXPECT_EQ(checksumOf(part), 0x9b41d26fu);
  EXPECT_EQ(unitsAt(part, {{-1, -1, -1}}, kFreeClass, 511), -7);
  const Block* const marked = map.find({{8, 0, -8}});
  ASSERT_NE(marked, nullptr);
  EXPECT_TRUE(marked->classes().empty());
  for (std::size_t v = 0; v < kBlockVoxels; ++v) ASSERT_EQ(marked->occlusion()[v], v % 3 == 0) << v;
}

TEST_P(Version, HoldsItsLooks) {
  MapFile file(file_, MapFile::Access::kRead);
  const SemanticMap map = readPart(file, 0), part = readPart(file, 1);
  for (const SemanticMap* const each : {&map, &part}) {
    for (const auto& [index, block] : each->entries()) {
      const bool has_looks = GetParam() >= 3 && index == GridIndex{0, 0, 0};
      EXPECT_EQ(block->looks().empty(), !has_looks);
    }
  }
  if (GetParam() < 3) return;
  const Looks &looks = map.find({{0, 0, 0}})->looks(), &of_part = part.find({{0, 0, 0}})->looks();
  EXPECT_EQ(looks.all().size(), 8u);
  EXPECT_EQ(looks.all()[0].begin(), 6332874752u);
  EXPECT_EQ(looks.all()[0].level(), 16u);
  EXPECT_EQ(looks.all()[0].at(0), Sight::kHit);
  EXPECT_EQ(looks.all()[0].at(1), Sight::kNothing);
  EXPECT_EQ(looks.all()[0].at(2), Sight::kVoid);
  EXPECT_EQ(looks.all()[0].at(4), Sight::kCrossed);
  EXPECT_EQ(checksumOf(looks), 0x527149d5u);
  EXPECT_EQ(of_part.all().size(), 2u);
  EXPECT_EQ(checksumOf(of_part), 0xb1b1e00cu);
}

TEST_P(Version, HoldsWhatTheMapIsAbout) {
  MapFile file(file_, MapFile::Access::kRead);
  const MapInfo& info = file.info();
  EXPECT_EQ(info.resolution, 0.25);
  EXPECT_EQ(info.prior, 0.001);
  EXPECT_EQ(info.unit_exponent, 16);
  EXPECT_EQ(info.frame, "map");
  EXPECT_EQ(info.parameters, "resolution: 0.25\nfree_space:\n  mode: line\n");
  EXPECT_EQ(info.program, GetParam() < 4 ? "bki_mapping 0.1.0" : "bki_mapping 0.2.0");
  EXPECT_EQ(info.classes->name(), "example");
  EXPECT_EQ(info.classes->labelMask(), GetParam() == 1 ? ClassTable::kAllBits : kExampleMask);
  ASSERT_EQ(info.classes->size(), 3u);
  const SemanticClass &unlabelled = info.classes->classes()[0], &street = info.classes->classes()[1],
                      &car = info.classes->classes()[2];
  EXPECT_EQ(unlabelled.id, 0);
  EXPECT_EQ(unlabelled.name, "unlabelled");
  EXPECT_TRUE(unlabelled.unlabelled && unlabelled.any_raw && unlabelled.ignored);
  EXPECT_FALSE(unlabelled.dynamic || unlabelled.ground || unlabelled.free_gain);
  EXPECT_TRUE(unlabelled.raw.empty());
  EXPECT_EQ(street.id, 40);
  EXPECT_EQ(street.name, "Stra\303\237e");
  EXPECT_EQ(street.color, (std::array<std::uint8_t, 3>{128, 64, 255}));
  EXPECT_EQ(street.raw, (std::vector<std::uint32_t>{40, 60, 4000000000u}));
  EXPECT_TRUE(street.ground);
  EXPECT_FALSE(street.unlabelled || street.any_raw || street.dynamic || street.ignored || street.free_gain);
  EXPECT_EQ(car.id, 253);
  EXPECT_TRUE(car.dynamic);
  EXPECT_FALSE(car.living);
  EXPECT_EQ(car.free_gain, 2.5);

  const std::vector<DriveRecord> drives = file.drives();
  ASSERT_EQ(drives.size(), 2u);
  EXPECT_EQ(drives[0].id, "3f1c");
  EXPECT_EQ(drives[0].name, "to the east");
  EXPECT_EQ(drives[0].part, 0);
  EXPECT_EQ(drives[0].scans, 271u);
  EXPECT_EQ(drives[0].first_stamp, 1700000000000000001u);
  EXPECT_EQ(drives[0].last_stamp, 1700000027000000000u);
  EXPECT_EQ(drives[0].bounds.min(), Eigen::Vector3d(-2.0, -2.0, -16.0));
  EXPECT_EQ(drives[0].bounds.max(), Eigen::Vector3d(18.0, 16.0, 16.0));
  EXPECT_EQ(drives[1].id, "9e02");
  EXPECT_EQ(drives[1].part, 1);
  EXPECT_TRUE(drives[1].bounds.isEmpty());
}

TEST_P(Version, HoldsItsJournal) {
  MapFile file(file_, MapFile::Access::kRead);
  EXPECT_EQ(file.hasJournal(), GetParam() >= 4);
  const std::vector<ScanRecord> scans = file.scans();
  if (GetParam() < 4) {
    EXPECT_TRUE(scans.empty() && file.settings().empty() && file.clearedBoxes().empty());
    return;
  }
  ASSERT_EQ(scans.size(), 2u);
  EXPECT_EQ(scans[0].number, 7u);
  EXPECT_EQ(scans[1].number, 300u);
  EXPECT_EQ(scans[1].drive, "3f1c");
  EXPECT_EQ(scans[0].stamp, 1700000000000000001u);
  EXPECT_EQ(scans[0].sensor, "");
  EXPECT_EQ(scans[1].sensor, "velodyne");
  EXPECT_TRUE(scans[0].settings == 0 && scans[0].cleared == 0 && !scans[0].jump);
  EXPECT_TRUE(scans[1].settings == 1 && scans[1].cleared == 1 && scans[1].jump);
  EXPECT_EQ(scans[0].reach, 81.5);
  EXPECT_EQ(scans[0].T_map_sensor(1, 3), -1.0 / 3.0);
  EXPECT_EQ(scans[0].T_map_sensor(0, 0), 1.0);
  EXPECT_EQ(scans[1].T_map_sensor(0, 1), -1.0);
  EXPECT_EQ(scans[1].T_odometry_sensor(0, 3), -0.125);
  EXPECT_EQ(scans[0].tiles, (std::vector<GridIndex>{{-1, -1, -1}, {0, 0, 0}, {1, 0, 0}}));
  EXPECT_EQ(scans[1].tiles, (std::vector<GridIndex>{{0, 0, -70000}, {4000000, 0, 0}, {-1, 100, 0}}));
  const std::string content = file.scanContent(300);
  EXPECT_EQ(content.size(), 10000u);
  EXPECT_EQ(content[3], static_cast<char>(900 % 251));
  EXPECT_EQ(file.scanContent(7), exampleContent(7));
  ASSERT_EQ(file.settings().size(), 2u);
  EXPECT_EQ(file.settings()[1], "resolution: 0.25\nfree_space:\n  mode: none\n");
  ASSERT_EQ(file.clearedBoxes().size(), 1u);
  EXPECT_EQ(file.clearedBoxes()[0].min().z(), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(file.clearedBoxes()[0].max().x(), 1.5);
}

TEST_P(Version, KeepsAJournalOrSaysThatItHasNone) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  std::filesystem::copy_file(file_, path);
  std::filesystem::permissions(path, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  ScanRecord scan = exampleScans()[1];
  scan.number = 301;
  scan.T_map_sensor.translation().x() = 12.0;
  MapFile file(path, MapFile::Access::kUpdate);
  if (GetParam() < 4) {
    MapFile::Change change = file.change();
    EXPECT_EQ(
        sentenceOf([&] { change.addSettings("x: 1\n"); }),
        path +
            " is of a version of the format that has no journal of scans; convert it with migrate_map, or "
            "do without the journal");
    EXPECT_NE(sentenceOf([&] { change.addScan(scan, ""); }), "");
    EXPECT_NO_THROW(change.eraseJournal());
    return;
  }
  {
    MapFile::Change change = file.change();
    scan.settings = change.addSettings("x: 1\n");
    EXPECT_EQ(scan.settings, 2);
    scan.cleared = change.addClearedBox(exampleCleared()[0]);
    EXPECT_EQ(scan.cleared, 2);
    change.addScan(scan, "abc");
    ScanRecord moved = exampleScans()[0];
    moved.T_map_sensor.translation().x() = 5.0;
    moved.tiles = {{2, 0, 0}};
    change.moveScan(moved);
    change.commit();
  }
  EXPECT_EQ(file.scans().size(), 3u);
  EXPECT_EQ(file.scans()[0].T_map_sensor.translation().x(), 5.0);
  EXPECT_EQ(file.scans()[0].tiles, (std::vector<GridIndex>{{2, 0, 0}}));
  EXPECT_EQ(file.scanContent(7), exampleContent(7));
  EXPECT_EQ(file.scans()[2].number, 301u);
  EXPECT_EQ(file.scans()[2].cleared, 2);
  EXPECT_EQ(file.scanContent(301), "abc");
  const std::string journal = journalOf(file);
  { const MapFile closed = std::move(file); }
  file = MapFile(path, MapFile::Access::kUpdate);  // its checksums are right
  EXPECT_EQ(journalOf(file), journal);
  {
    MapFile::Change change = file.change();
    ScanRecord wrong = scan;
    wrong.number = 302;
    wrong.settings = 3;
    EXPECT_THROW(change.addScan(wrong, ""), std::invalid_argument) << "there are no such settings";
    EXPECT_THROW(change.moveScan(wrong), std::invalid_argument) << "there is no such scan";
    wrong.settings = 0;
    wrong.T_map_sensor.linear() *= 2.0;
    EXPECT_THROW(change.addScan(wrong, ""), std::invalid_argument) << "that is no rotation";
    change.eraseJournal();
    change.commit();
  }
  EXPECT_TRUE(file.scans().empty() && file.settings().empty() && file.clearedBoxes().empty());
  EXPECT_TRUE(MapFile(std::move(file)).drives() == exampleDrives());
}

// What write_example_map would write today reads as what it wrote then.
TEST_P(Version, IsWhatTheFormulasSay) {
  const SemanticMap part = exampleMap(1, GetParam());
  SemanticMap sum = exampleMap(0, GetParam());
  sum.add(part);
  MapFile file(file_, MapFile::Access::kRead);
  EXPECT_EQ(reference::contentOf(readPart(file, 0)), reference::contentOf(sum));
  EXPECT_EQ(reference::contentOf(readPart(file, 1)), reference::contentOf(part));
  EXPECT_TRUE(file.drives() == exampleDrives());
  EXPECT_NO_THROW(checkSameGrid("file", file.info(), "formulas", exampleInfo()));
}

TEST_P(Version, IsUpdatedByThisVersion) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  std::filesystem::copy_file(file_, path);
  std::filesystem::permissions(path, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  {
    MapFile file(path, MapFile::Access::kUpdate);
    MapFile::Change change = file.change();
    change.writeTile(exampleMap(1), {{0, 0, 0}});
    change.eraseDrive("3f1c");
    change.commit();
  }
  MapFile file(path, MapFile::Access::kRead);
  EXPECT_EQ(file.drives().size(), 1u);
  const SemanticMap map = readPart(file, 0);
  EXPECT_EQ(map.size(), GetParam() < 6 ? 3u : 4u);
  EXPECT_EQ(unitsAt(map, {{0, 0, 0}}, 40, 3), 3);
  EXPECT_EQ(map.find({{0, 0, 0}})->looks().empty(), GetParam() < 3) << "the file keeps its version";
}

TEST(NewerVersion, IsRefused) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  std::filesystem::copy_file(BKI_MAPPING_SOURCE_DIR "/test/store/data/version_1.bkm", path);
  std::filesystem::permissions(path, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary).seekp(63).put('\7');
  for (const auto access : {MapFile::Access::kRead, MapFile::Access::kUpdate}) {
    EXPECT_EQ(
        sentenceOf([&] { MapFile(path, access); }),
        path +
            " was written by a newer version of bki_mapping (format 7, this one knows formats up to 6); "
            "use that version or a later one");
  }
}

}  // namespace
}  // namespace bki_mapping
