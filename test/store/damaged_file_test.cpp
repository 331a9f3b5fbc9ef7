// A damaged or hostile map file is refused in one sentence, or read as it was; without a crash, in time, and
// in memory that goes with its size.
#include <gtest/gtest.h>

#include <random>

#include "bki_mapping/store/map_file.h"
#include "store/counted_memory.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kPage = 4096;

/// A file, its content, and what became of damaged copies of it.
class Original {
 public:
  explicit Original(std::string bytes) : bytes_(std::move(bytes)) {
    writeFile(path_, bytes_);
    content_ = contentOf(path_);
  }
  const std::string& bytes() const { return bytes_; }
  std::size_t refused() const { return refused_; }
  std::size_t whole() const { return whole_; }

  /// Holds the law for a damaged copy.
  void check(const std::string& damaged, const std::string& what) {
    writeFile(path_, damaged);
    const PeakMemory memory;
    try {
      const bool same = contentOf(path_) == content_;
      EXPECT_TRUE(same) << what;
      ++whole_;
    } catch (const MapFileError& error) {
      const std::string sentence = error.what();
      EXPECT_EQ(sentence.rfind(path_ + " ", 0), 0u) << what << ": " << sentence;
      EXPECT_NE(sentence.find("; "), std::string::npos) << "no remedy in: " << sentence;
      EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
      ++refused_;
    } catch (const std::exception& error) {
      ADD_FAILURE() << what << ": " << error.what();
    }
    EXPECT_LT(memory.bytes(), memoryLimit(damaged.size())) << what;
    EXPECT_EQ(folder_.fileCount(), 1u) << what;
  }

 private:
  TemporaryFolder folder_{memoryFolder()};
  const std::string path_ = folder_ / "map.bkm";
  std::string bytes_;
  FileContent content_;
  std::size_t refused_ = 0, whole_ = 0;
};

/// One page for each table.
std::string smallFile() {
  return readFile(BKI_MAPPING_SOURCE_DIR "/test/store/data/version_6.bkm");
}

/// Trees of several pages, and pages that are free.
std::string largeFile() {
  const TemporaryFolder folder(memoryFolder());
  const std::string path = folder / "map.bkm";
  SemanticMap map = infoOf().emptyMap();
  std::mt19937 random(1);
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  for (int b = 0; b < 260; ++b) {
    for (int voxel = 0; voxel < 10; ++voxel)
      plane[random() % plane.size()] = static_cast<EvidenceUnits>(random() % 100000);
    map.getOrAllocate({{8 * (b % 20), 8 * (b / 20), 0}}).add(40, plane.data());
    plane[random() % plane.size()] = 0;
  }
  std::vector<DriveRecord> drives;
  for (int d = 0; d < 40; ++d) drives.push_back(driveOf("drive " + std::to_string(100 + d)));
  saveMap(path, infoOf(), drives, map);
  MapFile file(path, MapFile::Access::kUpdate);
  MapFile::Change change = file.change();
  for (int b = 0; b < 40; ++b) change.eraseTile({{b % 20, b / 20, 0}});
  change.commit();
  return readFile(path);
}

class DamagedFile : public testing::TestWithParam<std::string (*)()> {
 protected:
  std::size_t below(std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random_);
  }

  Original original_{GetParam()()};
  std::mt19937 random_{1};
};
INSTANTIATE_TEST_SUITE_P(Files, DamagedFile, testing::Values(smallFile, largeFile));

TEST_P(DamagedFile, IsRefusedIfItIsCutOff) {
  const std::size_t size = original_.bytes().size();
  std::vector<std::size_t> sizes{0, 1, 99, 100, 511, 512, 1000};
  for (std::size_t pages = kPage; pages <= size; pages += kPage) {
    for (const std::size_t each : {pages - 1, pages, pages + 1}) sizes.push_back(each);
  }
  std::size_t cut = 0;
  for (const std::size_t each : sizes) {
    if (each >= size) continue;
    original_.check(original_.bytes().substr(0, each), "cut off after " + std::to_string(each));
    EXPECT_EQ(original_.refused(), ++cut) << each;
  }
  original_.check(original_.bytes() + std::string(5000, 'x'), "extended");
}

TEST_P(DamagedFile, MayHaveABitFlipped) {
  std::vector<std::size_t> bits;
  const std::size_t pages = original_.bytes().size() / kPage;
  if (pages < 10) {
    for (std::size_t bit = 0; bit < 8 * 108; ++bit) bits.push_back(bit);
  }
  for (int i = 0; i < 250; ++i) bits.push_back(8 * kPage * below(pages) + below(8 * 12));  // heads of pages
  for (int i = 0; i < 250; ++i) bits.push_back(below(8 * original_.bytes().size()));
  for (const std::size_t bit : bits) {
    std::string damaged = original_.bytes();
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << bit % 8);
    original_.check(damaged, "bit " + std::to_string(bit));
  }
  EXPECT_GT(original_.refused(), bits.size() / 4);
  EXPECT_GT(original_.whole(), bits.size() / 20);
}

// Whoever asks for a tile and is told that there is none does not find the damage by its checksum.
TEST_P(DamagedFile, HasNoOtherListOfTiles) {
  const TemporaryFolder folder(memoryFolder());
  const std::string path = folder / "map.bkm";
  writeFile(path, original_.bytes());
  const std::vector<TileEntry> tiles = MapFile(path, MapFile::Access::kRead).tiles();
  std::vector<std::size_t> index_pages;
  for (std::size_t page = kPage; page < original_.bytes().size(); page += kPage) {
    const char kind = original_.bytes()[page];
    if (kind == 2 || kind == 10) index_pages.push_back(page);
  }
  ASSERT_FALSE(index_pages.empty());
  std::size_t refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string damaged = original_.bytes();
    const std::size_t byte = index_pages[below(index_pages.size())] + below(kPage);
    damaged[byte] = static_cast<char>(damaged[byte] ^ 1 << below(8));
    writeFile(path, damaged);
    std::vector<TileEntry> found;
    if (sentenceOf([&] { found = MapFile(path, MapFile::Access::kRead).tiles(); }) != "") {
      ++refused;
    } else {
      EXPECT_TRUE(found == tiles) << byte;
    }
  }
  EXPECT_GT(refused, 5u);
}

TEST_P(DamagedFile, MayHoldGarbage) {
  for (int i = 0; i < 240; ++i) {
    std::string damaged = original_.bytes();
    const std::size_t begin = below(damaged.size()), most = std::min(damaged.size() - begin, 2 * kPage);
    const std::size_t length = 1 + below(below(2) == 0 ? std::min<std::size_t>(most, 8) : most),
                      kind = below(3);
    for (std::size_t b = begin; b < begin + length; ++b) {
      damaged[b] = static_cast<char>(kind == 0 ? 0 : kind == 1 ? 0xff : below(256));
    }
    original_.check(damaged, std::to_string(length) + " bytes from " + std::to_string(begin));
  }
  EXPECT_GT(original_.refused(), 100u);
}

TEST_P(DamagedFile, MayHavePagesInOtherPlaces) {
  const std::size_t pages = original_.bytes().size() / kPage;
  for (int i = 0; i < 120; ++i) {
    const std::size_t a = kPage * below(pages), b = kPage * below(pages);
    if (a == b) continue;
    std::string damaged = original_.bytes();
    damaged.replace(a, kPage, original_.bytes(), b, kPage);
    const std::string which = std::to_string(a) + " and " + std::to_string(b);
    original_.check(damaged, "copy, pages at " + which);
    damaged.replace(b, kPage, original_.bytes(), a, kPage);
    original_.check(damaged, "swap, pages at " + which);
  }
  EXPECT_GT(original_.refused(), 100u);
}

// Damage that reading does not meet, such as in the list of free pages, must not spread unnoticed.
TEST_P(DamagedFile, IsUpdatedOrRefused) {
  const TemporaryFolder folder(memoryFolder());
  const std::string path = folder / "map.bkm";
  const auto change = [&] {
    MapFile file(path, MapFile::Access::kUpdate);
    MapFile::Change begun = file.change();
    for (const TileEntry& tile : file.tiles()) {
      if (tile.index.x % 2 == 0) begun.eraseTile({tile.index});
    }
    SemanticMap update = file.info().emptyMap();
    for (int b = 0; b < 40; ++b) {
      update.getOrAllocate({{24 * b - 200, 8 * (b % 3), 0}})
          .add(40, std::vector<EvidenceUnits>(kBlockVoxels, b - 3).data());
    }
    for (const GridIndex& tile : tilesOf(update)) begun.writeTile(update, {tile});
    begun.putDrive(driveOf("another"));
    begun.commit();
  };
  writeFile(path, original_.bytes());
  change();
  const FileContent expected = contentOf(path);
  std::size_t updated = 0;
  for (int i = 0; i < 100; ++i) {
    std::string damaged = original_.bytes();
    // Half of them in what a reader does not look at: the rest of the first page, and pages that are free.
    const std::size_t byte = i % 2 == 0 ? below(damaged.size()) : 28 + below(damaged.size() / kPage) * kPage;
    damaged[byte] = static_cast<char>(damaged[byte] ^ 1 << below(8));
    writeFile(path, damaged);
    FileContent found;
    if (sentenceOf([&] {
          change();
          found = contentOf(path);
        }) == "") {
      EXPECT_TRUE(found == expected) << byte;
      ++updated;
    }
  }
  EXPECT_GT(updated, 20u);
}

}  // namespace
}  // namespace bki_mapping
