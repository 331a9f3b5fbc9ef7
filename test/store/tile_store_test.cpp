// A map file with a journal in a thread of its own, on disks that fail.
#include "store/tile_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <thread>

#include "store/example_map.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "store/watched_disk.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

class JournalledStore : public testing::Test {
 protected:
  JournalledStore() {
    NewMapFile file(path_, exampleInfo());
    addExampleJournal(file.content());
    file.commit();
  }

  TemporaryFolder folder_{memoryFolder()};
  const std::string path_ = folder_ / "map.bkm";
};

TEST_F(JournalledStore, MakesNothingDurableBetweenSaves) {
  const FileContent before = contentOf(path_);
  TileStore store(MapFile(path_, MapFile::Access::kUpdate), true);
  store.add({0, 0, 0}, exampleMap(1));
  store.putDrive(driveOf("a"));
  EXPECT_EQ(store.scanContent(300), exampleContent(300));
  store.waitForTrial();
  EXPECT_GT(store.waitingBytes(), 0u);
  EXPECT_NE(store.close(), "");
  EXPECT_TRUE(contentOf(path_) == before);
}

TEST_F(JournalledStore, WhoWaitsForAScanIsToldThatTheFileIsClosed) {
  std::atomic<bool> full{false};
  const WatchedDisk disk(std::filesystem::canonical(folder_.path()),
                         [&](const DiskCall&) { return full ? ENOSPC : 0; });
  TileStore store(MapFile(path_, MapFile::Access::kUpdate), true, std::chrono::milliseconds(10));
  full = true;
  store.save(exampleMap(1), tilesOf(exampleMap(1)), driveOf("a"));
  while (store.fault().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::string fault;
  std::thread reader([&] { fault = sentenceOf([&] { store.scanContent(300); }); });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // it waits behind the save
  EXPECT_NE(store.close(), "");
  reader.join();
  EXPECT_NE(fault.find("closed"), std::string::npos) << fault;
  EXPECT_NE(sentenceOf([&] { store.scanContent(300); }).find("closed"), std::string::npos);
}

TEST_F(JournalledStore, IsWholeAfterADiskThatFailsNowAndThen) {
  std::atomic<unsigned> calls{0};
  std::atomic<bool> failing{true};
  const WatchedDisk disk(std::filesystem::canonical(folder_.path()),
                         [&](const DiskCall&) { return failing && ++calls % 211 == 0 ? EIO : 0; });
  SemanticMap wanted = exampleInfo().emptyMap();
  std::vector<std::future<void>> saves;
  {
    TileStore store(MapFile(path_, MapFile::Access::kUpdate), true, std::chrono::milliseconds(1));
    for (std::uint64_t n = 0; n < 30; ++n) {
      const SemanticMap more = exampleMap(1);
      wanted.add(more);
      for (const GridIndex& tile : tilesOf(more)) {
        SemanticMap part = exampleMap(1);
        store.add(tile, part.takeRegion(tile));
      }
      ScanRecord scan = exampleScans()[0];
      scan.number = 1000 + n;
      saves.push_back(store.save(exampleInfo().emptyMap(), {}, driveOf("a"),
                                 {{}, {{scan, [n] { return exampleContent(n); }}}, {}}));
      EXPECT_EQ(store.scanContent(1000 + n), exampleContent(n));
    }
    EXPECT_GT(calls, 3 * 211u) << "the disk has failed";
    failing = false;
    for (std::future<void>& save : saves) save.get();
    EXPECT_EQ(store.close(), "");
  }
  MapFile file(path_, MapFile::Access::kRead);
  EXPECT_EQ(file.scans().size(), 32u);
  EXPECT_EQ(reference::contentOf(readMap(file).map), reference::contentOf(wanted));
}

TEST_F(JournalledStore, LeavesOutWhatIsNoScan) {
  TileStore store(MapFile(path_, MapFile::Access::kUpdate), true);
  ScanRecord wrong = exampleScans()[0], right = wrong;
  wrong.number = 1000;
  wrong.reach = -1.0;
  right.number = 1001;
  const auto content = [] { return std::string("x"); };
  store.save(exampleInfo().emptyMap(), {}, driveOf("a"), {{}, {{wrong, content}, {right, content}}, {wrong}})
      .get();
  EXPECT_EQ(store.close(), "");
  EXPECT_EQ(MapFile(path_, MapFile::Access::kRead).scans().size(), 3u);
}

}  // namespace
}  // namespace bki_mapping
