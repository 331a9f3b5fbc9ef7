// A file system that is really full. A program of its own, because the test is skipped where none may be
// mounted.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <memory>

#include "bki_mapping/store/map_file.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

void expectSentence(const std::string& sentence, const std::string& path) {
  EXPECT_EQ(sentence.rfind(path + " cannot be ", 0), 0u) << sentence;
  EXPECT_NE(sentence.find("MB free there); check "), std::string::npos) << sentence;
}

TEST(FullDisk, KeepsWhatIsInTheFile) {
  const TemporaryFolder folder;
  if (mount("none", folder.path().c_str(), "tmpfs", 0, "size=400k") != 0) {
    GTEST_SKIP() << "SKIPPED: needs the right to mount a small file system";
  }
  const std::unique_ptr<const TemporaryFolder, void (*)(const TemporaryFolder*)> mounted(
      &folder, [](const TemporaryFolder* of) { umount2(of->path().c_str(), MNT_DETACH); });
  const std::string path = folder / "map.bkm";
  const auto fill = [&] {
    MapFile file(path, MapFile::Access::kUpdate);
    for (unsigned seed = 1;; ++seed) {
      MapFile::Change change = file.change();
      const SemanticMap map = randomMap(seed, 20, 40);
      for (const GridIndex& tile : tilesOf(map)) change.writeTile(map, {tile, static_cast<int>(seed)});
      DriveRecord drive = driveOf("a");
      drive.scans = seed;
      change.putDrive(drive);
      change.commit();
    }
  };
  saveMap(path, infoOf(), {}, randomMap(1, 15));
  expectSentence(sentenceOf(fill), path);
  const FileContent content = contentOf(path);
  ASSERT_FALSE(content.drives.empty());
  EXPECT_EQ(content.parts.size(), content.drives[0].scans + 1);
  expectSentence(sentenceOf([&] { saveMap(path, infoOf(), {}, randomMap(1, 500)); }), path);
  EXPECT_TRUE(contentOf(path) == content);
  EXPECT_EQ(folder.fileCount(), 1u);
}

}  // namespace
}  // namespace bki_mapping
