// Map files of older versions become such of the present one.
#include "store/migration.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "reference/content.h"
#include "store/example_map.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "store/schema.h"
#include "store/tile_codec.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kVersionByte = 63;  // the last one of user_version
const std::string kVersion1 = BKI_MAPPING_SOURCE_DIR "/test/store/data/version_1.bkm";

std::string bytesOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void change(const std::string& path, std::size_t position, char byte) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(position));
  file.put(byte);
}

std::int64_t versionOf(const std::string& path) {
  return static_cast<unsigned char>(bytesOf(path)[kVersionByte]);
}

class MigrationFrom : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(All, MigrationFrom, testing::Range(1, static_cast<int>(kFormatVersion) + 1));

TEST_P(MigrationFrom, CopiesAll) {
  const TemporaryFolder folder;
  const std::string path =
      BKI_MAPPING_SOURCE_DIR "/test/store/data/version_" + std::to_string(GetParam()) + ".bkm";
  const std::string before = bytesOf(path);
  ASSERT_EQ(versionOf(path), GetParam());
  EXPECT_EQ(migrateMap(path, folder / "new.bkm"), GetParam());
  EXPECT_TRUE(bytesOf(path) == before);
  EXPECT_EQ(versionOf(folder / "new.bkm"), kFormatVersion);
  MapFile old(path, MapFile::Access::kRead), copy(folder / "new.bkm", MapFile::Access::kRead);
  EXPECT_TRUE(old.drives() == copy.drives());
  EXPECT_EQ(old.info().parameters, copy.info().parameters);
  EXPECT_EQ(old.info().program, copy.info().program);
  EXPECT_EQ(old.info().frame, copy.info().frame);
  EXPECT_EQ(old.info().classes->name(), copy.info().classes->name());
  EXPECT_EQ(copy.info().classes->labelMask(), GetParam() == 1 ? ClassTable::kAllBits : kExampleMask);
  EXPECT_NO_THROW(checkSameGrid("old", old.info(), "copy", copy.info()));
  EXPECT_NE(bytesOf(folder / "new.bkm").find("label_mask INTEGER"), std::string::npos) << "since version 2";
  EXPECT_EQ(journalOf(old), journalOf(copy));
  EXPECT_EQ(copy.scans().empty(), GetParam() < 4);
  ASSERT_EQ(old.parts(), copy.parts());
  ASSERT_GT(old.parts().size(), 1u);
  for (const int part : old.parts()) {
    SemanticMap a = old.info().emptyMap(), b = copy.info().emptyMap();
    for (const TileEntry& tile : old.tiles(part)) old.addTileTo(a, {tile.index, part});
    for (const TileEntry& tile : copy.tiles(part)) copy.addTileTo(b, {tile.index, part});
    EXPECT_GT(a.size(), 0u);
    EXPECT_TRUE(reference::contentOf(a) == reference::contentOf(b));
    TileCodec codec(*copy.info().classes);
    for (const TileEntry& tile : copy.tiles(part)) {
      EXPECT_TRUE(codec.pack(a, {tile.index, part}) == tile) << "as this version writes it";
    }
  }
  EXPECT_EQ(folder.fileCount(), 1u);
}

// A file that a program has brought up to date can hold looks; the old one can not.
TEST_P(MigrationFrom, MakesRoomForLooks) {
  const TemporaryFolder folder;
  const std::string old = folder / "old.bkm", copy = folder / "new.bkm";
  std::filesystem::copy_file(
      BKI_MAPPING_SOURCE_DIR "/test/store/data/version_" + std::to_string(GetParam()) + ".bkm", old);
  std::filesystem::permissions(old, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  migrateMap(old, copy);
  for (const std::string& path : {old, copy}) {
    {
      MapFile file(path, MapFile::Access::kUpdate);
      MapFile::Change change = file.change();
      change.writeTile(exampleMap(1), {{0, 0, 0}});
      change.commit();
    }
    MapFile file(path, MapFile::Access::kRead);
    SemanticMap map = file.info().emptyMap();
    file.addTileTo(map, {{0, 0, 0}});
    EXPECT_EQ(map.find({{0, 0, 0}})->looks().empty(), path == old && GetParam() < 3) << path;
  }
}

TEST(Migration, RefusesWhatItCannotRead) {
  const TemporaryFolder folder;
  const std::string old = folder / "old.bkm", output = folder / "new.bkm";
  const auto fault = [&] { return sentenceOf([&] { migrateMap(old, output); }); };
  EXPECT_NE(fault().find("cannot be opened"), std::string::npos) << fault();
  std::filesystem::copy_file(kVersion1, old);
  std::filesystem::permissions(old, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  change(old, kVersionByte, kFormatVersion + 1);
  EXPECT_NE(fault().find(old + " was written by a newer version of bki_mapping"), std::string::npos)
      << fault();
  change(old, kVersionByte, 0);
  EXPECT_NE(fault().find(old + " is damaged"), std::string::npos) << fault();
  change(old, kVersionByte, kFormatVersion);
  EXPECT_NE(fault().find(old + " is damaged (its tables"), std::string::npos) << fault();
  change(old, kVersionByte, 1);
  EXPECT_EQ(fault(), "");
  EXPECT_EQ(fault(), output + " exists already; choose another name");
  std::filesystem::remove(output);
  // A byte in the content of a tile.
  const std::size_t content = bytesOf(old).find("\x78\x01");  // a zlib stream
  ASSERT_NE(content, std::string::npos);
  change(old, content + 6, static_cast<char>(~bytesOf(old)[content + 6]));
  EXPECT_EQ(fault().find(old + " is damaged (tile"), 0u) << fault();
  EXPECT_EQ(folder.fileCount(), 1u);
}

void toVersion5(Database& database) {
  database.run("CREATE TABLE history (version INTEGER)");
  database.run("INSERT INTO history VALUES (5)");
}
void toVersion6(Database& database) {
  database.run("INSERT INTO history SELECT max(version) + 1 FROM history");
}

TEST(Migration, GoesStepByStep) {
  const TemporaryFolder folder;
  const std::string path = folder / "file";
  std::ofstream(path).close();
  const std::vector<MigrationStep> steps = {{5, toVersion6}, {4, toVersion5}};
  Database database(path, Database::Mode::kNew);
  migrate(database, 4, 4, steps);
  migrate(database, 4, 6, steps);
  Statement history = database.prepare("SELECT sum(version) FROM history");
  ASSERT_TRUE(history.step());
  EXPECT_EQ(history.integer(0), 5 + 6);
  Statement version = database.prepare("PRAGMA user_version");
  ASSERT_TRUE(version.step());
  EXPECT_EQ(version.integer(0), 6);
  EXPECT_THROW(migrate(database, 6, 7, steps), std::logic_error);
}

}  // namespace
}  // namespace bki_mapping
