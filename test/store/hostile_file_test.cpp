// Map files that somebody made in order to do harm are refused in one sentence, in time, and in memory that
// goes with their size: their checksums are right, and their content is wrong.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "bki_mapping/store/map_file.h"
#include "store/counted_memory.h"
#include "store/example_map.h"
#include "store/file_content.h"
#include "store/forgery.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kPage = 4096;
const std::string kFile = BKI_MAPPING_SOURCE_DIR "/test/store/data/version_6.bkm";

class HostileFile : public testing::Test {
 protected:
  HostileFile() { writeFile(path_, readFile(kFile)); }

  void forge(const std::string& sql) {
    Forgery forgery(path_);
    EXPECT_TRUE(forgery.run(sql)) << sql;
    forgery.sign();
  }
  /// The sentence that refuses the file. @param words that it has.
  void expectRefused(const std::string& words, const std::string& what) {
    const PeakMemory memory;
    const auto start = std::chrono::steady_clock::now();
    const std::string sentence = sentenceOf([&] { contentOf(path_); });
    EXPECT_NE(sentence.find(words), std::string::npos) << what << ": " << sentence;
    EXPECT_EQ(sentence.rfind(path_ + " is damaged (", 0), 0u) << what << ": " << sentence;
    EXPECT_LT(sentence.size(), 1000u);
    EXPECT_LT(memory.bytes(), 8'000'000 + static_cast<std::ptrdiff_t>(20 * readFile(path_).size())) << what;
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10)) << what;
    EXPECT_EQ(folder_.fileCount(), 1u) << what;
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "map.bkm";
};

TEST_F(HostileFile, IsReadIfNothingIsWrongWithIt) {
  const FileContent content = contentOf(path_);
  forge("UPDATE drive SET name = name");
  EXPECT_TRUE(contentOf(path_) == content);
}

TEST_F(HostileFile, HasWrongValues) {
  const std::pair<const char*, const char*> kForgeries[] = {
      {"UPDATE map SET resolution = -0.25", "resolution"},
      {"UPDATE map SET resolution = 9e999", "resolution"},
      {"UPDATE map SET resolution = NULL", "not a real number"},
      {"UPDATE map SET resolution = 'x'", "not a real number"},
      {"UPDATE map SET prior = 0", "prior"},
      {"UPDATE map SET unit_exponent = 15", "unit exponent"},
      {"UPDATE map SET unit_exponent = 4294967312", "out of range"},
      {"UPDATE map SET frame = x'00'", "not a text"},
      {"UPDATE map SET frame = NULL", "not a text"},
      {"UPDATE map SET frame = 'map' || char(0) || 'b'", "zero byte"},
      {"INSERT INTO map SELECT * FROM map", "two rows"},
      {"DELETE FROM map", "is empty"},
      {"UPDATE map SET label_mask = 0", "label_mask is 0"},
      {"UPDATE map SET label_mask = 255", "bits that label_mask 0xFF leaves out"},
      {"UPDATE map SET label_mask = 4294967296", "out of range"},
      {"UPDATE map SET label_mask = NULL", "not an integer"},
      {"DELETE FROM class", "class"},
      {"UPDATE class SET id = 40", "40"},
      {"UPDATE class SET id = 255 WHERE id = 40", "255"},
      {"UPDATE class SET id = 256 WHERE id = 40", "out of range"},
      {"UPDATE class SET id = -1 WHERE id = 40", "out of range"},
      {"UPDATE class SET red = 256", "out of range"},
      {"UPDATE class SET dynamic = 3", "out of range"},
      {"UPDATE class SET raw = '1,2'", "raw labels"},
      {"UPDATE class SET raw = '4294967296'", "raw labels"},
      {"UPDATE class SET free_gain = -1.0", "gain"},
      {"UPDATE class SET free_gain = 9e999", "gain"},
      {"INSERT INTO class SELECT class.* FROM class, (SELECT 1 UNION ALL SELECT 2)", "class"},
      {"WITH n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 300) INSERT INTO class SELECT i, i, "
       "i, 0, 0, 0, '', 0, 0, 0, 0, "
       "0, NULL, 0 FROM n",
       "more content"},
      {"UPDATE drive SET scans = -1", "out of range"},
      {"UPDATE drive SET part = -1", "part"},
      {"UPDATE drive SET part = -1, id = replace(hex(zeroblob(1000)), '0', char(27))", "drive '????"},
      {"UPDATE drive SET part = 4294967297", "out of range"},
      {"UPDATE drive SET id = '' WHERE part = 1", "the id of a drive is empty"},
      {"UPDATE drive SET id = 'same'", "twice"},
      {"UPDATE drive SET min_x = 9e999", "bounds"},
      {"UPDATE drive SET min_x = NULL", "not a real number"},
      {"UPDATE tile SET part = -1", "out of range"},
      {"UPDATE tile SET part = 4294967296", "out of range"},
      {"UPDATE tile SET x = 4194306", "out of range"},
      {"UPDATE tile SET x = 1e10", "out of range"},
      {"UPDATE tile SET x = 'x'", "not an integer"},
      {"UPDATE tile SET x = x + 1", "checksum"},
      {"UPDATE tile SET blocks = 0", "out of range"},
      {"UPDATE tile SET blocks = 513", "out of range"},
      {"UPDATE tile SET planes = -1", "more content"},
      {"UPDATE tile SET planes = planes + 1", "a length is wrong"},
      {"UPDATE tile SET content = NULL", "not a blob"},
      {"UPDATE tile SET content = x''", "too short"},
      {"UPDATE tile SET content = 'text'", "not a blob"},
      {"UPDATE tile SET content = zeroblob(100)", "a length is wrong"},
      {"UPDATE scan SET pose = zeroblob(96) WHERE number = 7", "is no pose"},
      {"UPDATE scan SET pose = x'00'", "not 12 numbers"},
      {"UPDATE scan SET odometry = 7", "not"},
      {"UPDATE scan SET tiles = x'80'", "cut off"},
      {"UPDATE scan SET tiles = x'FFFFFFFF0F0000'", "out of range"},
      {"UPDATE scan SET tiles = x'000000000000'", "not sorted"},
      {"UPDATE scan SET settings = 2", "does not have"},
      {"UPDATE scan SET cleared = 2", "does not have"},
      {"UPDATE scan SET reach = -1.0", "out of range"},
      {"UPDATE scan SET jump = 2", "out of range"},
      {"UPDATE scan SET stamp = -1", "out of range"},
      {"UPDATE scan_content SET content = x'00' WHERE number = 7", "the checksum of scan 7"},
      {"DELETE FROM scan_content WHERE number = 7", "scan 7 is missing"},
      {"UPDATE scan SET bytes = 9999999 WHERE number = 7", "larger than the file"},
      {"UPDATE scan SET number = 4611686018427387905 WHERE number = 300", "above 2^62"},
      {"UPDATE scan SET number = -1 WHERE number = 7", "out of range"},
      {"UPDATE settings SET number = 5 WHERE number = 0", "missing"},
      {"UPDATE cleared SET min_x = NULL", "not a real number"},
      {"UPDATE tile SET content = x'FFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFF00000000'",
       "a length is wrong"},
      {"UPDATE tile SET content = x'FFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFF'",
       "a section is not known"},
      {"INSERT INTO tile SELECT part, z, y, x, blocks, planes, checksum + 1, content FROM tile",
       "out of order"},
  };
  for (const auto& [sql, words] : kForgeries) {
    writeFile(path_, readFile(kFile));
    forge(sql);
    expectRefused(words, sql);
  }
}

TEST_F(HostileFile, HasOtherTables) {
  for (const char* const sql :
       {"CREATE TABLE more (x)", "CREATE VIEW more AS SELECT * FROM map", "CREATE INDEX more ON drive (name)",
        "CREATE TRIGGER more AFTER DELETE ON total BEGIN DELETE FROM tile; END",
        "CREATE VIRTUAL TABLE more USING fts4(x)", "DROP INDEX tile_list",
        "ALTER TABLE map RENAME COLUMN frame TO frames", "ALTER TABLE total ADD COLUMN x",
        "DROP TABLE drive; CREATE VIEW drive AS SELECT * FROM tile",
        "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE TABLE map (a DEFAULT "
        "(randomblob(1000000000)))' "
        "WHERE name = 'map'",
        "PRAGMA writable_schema = ON; UPDATE sqlite_master SET rootpage = 1 WHERE name = 'map'",
        "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = NULL WHERE name = 'map'"}) {
    writeFile(path_, readFile(kFile));
    EXPECT_TRUE(Forgery(path_).run(sql)) << sql;
    expectRefused("", sql);
  }
}

void put(std::string& bytes, std::size_t position, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i)
    bytes[position + static_cast<std::size_t>(i)] = static_cast<char>(value >> 8 * (size - 1 - i));
}

/// An inner page of a tree with nothing but references to one other page. @param head where it begins.
std::string pageOf(std::uint32_t child, bool index, std::size_t head = 0) {
  const std::string row("\x09\1\1\1\1\1\1\1\1\0\0\0\0\1\1\1\1", 17);  // of an index: 8 columns of 1 byte
  const std::string cell = std::string(4, '\0') + (index ? '\x11' + row : "\1");
  const std::size_t cells = (kPage - head - 12) / (cell.size() + 2), content = kPage - cells * cell.size();
  std::string page(kPage, '\0');
  page[head] = index ? '\2' : '\5';
  put(page, head + 3, static_cast<std::uint32_t>(cells), 2);
  put(page, head + 5, static_cast<std::uint32_t>(content), 2);
  put(page, head + 8, child, 4);
  for (std::size_t c = 0; c < cells; ++c) {
    const std::size_t at = content + c * cell.size();
    put(page, head + 12 + 2 * c, static_cast<std::uint32_t>(at), 2);
    page.replace(at, cell.size(), cell);
    put(page, at, child, 4);
  }
  return page;
}

// A page of a tree refers to the next one some hundred times, that one to the next again, and so on: the rows
// are countless.
TEST_F(HostileFile, HasPagesThatContainEachOther) {
  for (const std::string table :
       {"sqlite_master", "map", "class", "drive", "total", "tile_list", "scan", "settings", "cleared"}) {
    std::string bytes = readFile(kFile);
    writeFile(path_, bytes);
    std::size_t root = 1;
    if (table != "sqlite_master") {
      root = static_cast<std::size_t>(
          Forgery(path_).number("SELECT rootpage FROM sqlite_master WHERE name = '" + table + "'"));
    }
    const std::size_t head = root == 1 ? 100 : 0, begin = (root - 1) * kPage;
    const bool index = table == "tile_list";
    // What was the root comes last; as page 1 does not fit, a page without rows takes its place.
    const std::string last = root == 1 ? readFile(kFile).substr(kPage, kPage) : bytes.substr(begin, kPage);
    auto pages = static_cast<std::uint32_t>(bytes.size() / kPage);
    bytes.replace(begin + head, kPage - head, pageOf(pages + 1, index, head), head, kPage - head);
    for (int level = 0; level < 8; ++level) bytes += pageOf(++pages + 1, index);
    bytes += last;
    put(bytes, 28, ++pages, 4);
    writeFile(path_, bytes);
    expectRefused("", table);
  }
}

// Rows that share one long text take much memory when they are read, and little in the file.
TEST_F(HostileFile, HasRowsInTheSamePlace) {
  DriveRecord drive = driveOf("a");
  drive.name = std::string(900'800, 'n');  // all but some hundred bytes of it go to other pages
  std::filesystem::remove(path_);
  saveMap(path_, exampleInfo(), {drive}, exampleMap(1));
  std::size_t page = 0;
  {
    Forgery forgery(path_);
    page = kPage * static_cast<std::size_t>(
                       forgery.number("SELECT rootpage - 1 FROM sqlite_master WHERE name = 'drive'"));
    EXPECT_TRUE(forgery.run("UPDATE total SET drives = 600"));
    forgery.signTotals();
  }
  std::string bytes = readFile(path_);
  put(bytes, page + 3, 600, 2);
  for (std::size_t row = 1; row < 600; ++row) bytes.replace(page + 8 + 2 * row, 2, bytes, page + 8, 2);
  writeFile(path_, bytes);
  expectRefused("share their texts", "rows");
}

TEST_F(HostileFile, HasAWriteAheadLog) {
  std::string bytes = readFile(kFile);
  bytes[18] = bytes[19] = '\2';
  writeFile(path_, bytes);
  expectRefused("not that of a map", "for reading");
  EXPECT_NE(sentenceOf([&] { MapFile(path_, MapFile::Access::kUpdate); }), "");
  EXPECT_EQ(folder_.fileCount(), 1u);
  EXPECT_EQ(readFile(path_), bytes);
}

TEST_F(HostileFile, ClaimsWhatItHasNoRoomFor) {
  for (const char* const sql :
       {"UPDATE total SET tiles = 9223372036854775807", "UPDATE total SET tiles = -1",
        "UPDATE total SET drives = 9223372036854775807", "UPDATE total SET classes = 9223372036854775807",
        "UPDATE total SET blocks = 4611686018427387904, planes = 4611686018427387904",
        "UPDATE total SET planes = 30000", "UPDATE total SET scans = 9223372036854775807",
        "UPDATE total SET scans = 1", "UPDATE total SET settings = -1", "UPDATE total SET cleared = 0"}) {
    writeFile(path_, readFile(kFile));
    {
      Forgery forgery(path_);
      EXPECT_TRUE(forgery.run(sql)) << sql;
      forgery.signTotals();
    }
    expectRefused("", sql);
  }
  // A small file that says it had the largest tile.
  writeFile(path_, readFile(kFile));
  forge("UPDATE tile SET blocks = 512, planes = 130560 WHERE part = 1 AND z = 0");
  expectRefused("more content", "the largest tile");
  // The same with room: in other rows, and then in the tile itself, whose list is right.
  for (const char* const content :
       {"content", "x'00060200FFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFF00' || zeroblob(132704)",
        "x'00060200012000000000000000000000000000000000000000000000' || zeroblob(200000)"}) {
    writeFile(path_, readFile(kFile));
    forge("UPDATE map SET parameters = hex(zeroblob(200000))");
    forge(std::string("UPDATE tile SET blocks = 512, planes = 130560, content = CAST(") + content +
          " AS BLOB) WHERE part = 1 AND z = 0");
    expectRefused("", content);
  }
}

// What compresses best is what takes most memory for its size.
TEST_F(HostileFile, TakesMemoryThatGoesWithItsSize) {
  for (const bool has_looks : {false, true}) {
    SemanticMap map = exampleInfo().emptyMap();
    const std::vector<EvidenceUnits> plane(kBlockVoxels, kMostUnits);
    for (int b = 0; b < 512; ++b) {
      Block& block = map.getOrAllocate({{b % 8, b / 8 % 8, b / 64}});
      for (const ClassId id : {ClassId{0}, ClassId{40}, ClassId{253}, kFreeClass}) {
        if (id == 0 || !has_looks) block.add(id, plane.data());
      }
      for (std::uint64_t level = 0; has_looks && level < 36; ++level) {
        block.looks().add(
            Look((std::uint64_t{1} << 36) - (std::uint64_t{1} << level), ~Look::Voxels(), {}, {}));
      }
    }
    std::filesystem::remove(path_);
    saveMap(path_, exampleInfo(), {}, map);
    const std::size_t size = readFile(path_).size();
    EXPECT_LT(size, has_looks ? 160'000u : 60'000u);  // with a page for each table
    {
      const PeakMemory memory;
      loadMap(path_);
      EXPECT_LT(memory.bytes(), memoryLimit(size));
    }
    const PeakMemory memory;
    EXPECT_NE(sentenceOf([&] { loadMap(path_, 1'000'000); }).find("limit"), std::string::npos);
    EXPECT_LT(memory.bytes(), 1'000'000);
  }
}

}  // namespace
}  // namespace bki_mapping
