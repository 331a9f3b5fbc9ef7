// A process that is killed leaves a map file with everything that it reported as stored, and nothing but
// whole changes. Its lock goes with it.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>

#include "bki_mapping/store/map_file.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "store/watched_disk.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

constexpr unsigned kNever = std::numeric_limits<unsigned>::max();

/// What is stored by change n.
SemanticMap mapOf(unsigned n) {
  return randomMap(n, 15);
}
DriveRecord driveNumber(unsigned n) {
  DriveRecord drive = driveOf("a");
  drive.scans = n;
  return drive;
}

class Killed : public testing::TestWithParam<bool> {
 protected:
  using Report = std::function<void(unsigned)>;
  using Program = std::function<void(const Report&)>;

  /// Changes the file from whatever is in it, n, to n + 1 and so on.
  void update(const Report& report) const {
    MapFile file(path_, MapFile::Access::kUpdate);
    for (auto n = static_cast<unsigned>(file.drives().at(0).scans) + 1;; ++n) {
      MapFile::Change change = file.change();
      for (const TileEntry& tile : file.tiles()) change.eraseTile({tile.index});
      const SemanticMap map = mapOf(n);
      for (const GridIndex& tile : tilesOf(map)) change.writeTile(map, {tile});
      change.putDrive(driveNumber(n));
      change.commit();
      report(n);
    }
  }
  /// Replaces the file likewise.
  void replace(const Report& report) const {
    for (auto n = static_cast<unsigned>(loadMap(path_).drives.at(0).scans) + 1;; ++n) {
      saveMap(path_, infoOf(), {driveNumber(n)}, mapOf(n));
      report(n);
    }
  }

  /// Runs a program in a process of its own, and kills that at its next call to the disk after `calls` of
  /// them, or some `microseconds` after its first report. @return what it reported last; 0: nothing.
  unsigned kill(const Program& program, unsigned calls, unsigned microseconds) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      close(ends[0]);
      unsigned left = calls;
      const WatchedDisk disk(folder_.path(),
                             [&](const DiskCall&) { return left-- == 0 ? raise(SIGKILL) : 0; });
      try {
        program([&](unsigned n) { [[maybe_unused]] const ssize_t size = write(ends[1], &n, sizeof n); });
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
      }
      _exit(1);
    }
    close(ends[1]);
    unsigned last = 0;
    const auto next = [&] { return read(ends[0], &last, sizeof last) == sizeof last; };
    if (calls == kNever && next()) {
      usleep(microseconds);  // the moment is the matter of the test
      ::kill(child, SIGKILL);
    }
    while (next()) continue;
    close(ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << status;
    return last;
  }

  /// Kills a program fifty times, each time where it was before. @param most_calls of a change to the disk.
  void killAgainAndAgain(const Program& program, unsigned most_calls) {
    std::mt19937 random(GetParam() ? 1 : 2);
    saveMap(path_, infoOf(), {driveNumber(1)}, mapOf(1));
    unsigned stored = 1, unreported = 0;
    for (int i = 0; i < 50; ++i) {
      const unsigned last = GetParam() ? kill(program, static_cast<unsigned>(random() % (2 * most_calls)), 0)
                                       : kill(program, kNever, static_cast<unsigned>(random() % 3000));
      stored = std::max(stored, last);
      MapFile file(path_, MapFile::Access::kRead);
      const std::vector<DriveRecord> drives = file.drives();
      ASSERT_EQ(drives.size(), 1u);
      const auto found = static_cast<unsigned>(drives[0].scans);
      ASSERT_TRUE(found == stored || found == stored + 1) << found << " instead of " << stored;
      ASSERT_EQ(drives[0], driveNumber(found));
      ASSERT_EQ(contentOf(file).parts.at(0), reference::contentOf(mapOf(found)));
      unreported += found > stored;
      stored = found;
    }
    EXPECT_GT(stored, 20u);
    RecordProperty("unreported", static_cast<int>(unreported));
    // What the killed left is gone with the next file.
    saveMap(path_, infoOf(), {}, mapOf(1));
    EXPECT_EQ(folder_.fileCount(), 1u);
  }

  TemporaryFolder folder_{std::filesystem::canonical(memoryFolder())};
  const std::string path_ = folder_ / "map.bkm";
};
INSTANTIATE_TEST_SUITE_P(AtCallsOrTimes, Killed, testing::Bool());

TEST_P(Killed, WhileItChangesAFile) {
  killAgainAndAgain([this](const Report& report) { update(report); }, 80);
}

TEST_P(Killed, WhileItReplacesAFile) {
  killAgainAndAgain([this](const Report& report) { replace(report); }, 40);
}

TEST(LockedFile, IsRefusedToOtherProcesses) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  saveMap(path, infoOf(), {}, mapOf(1));
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    const MapFile file(path, MapFile::Access::kUpdate);
    [[maybe_unused]] const ssize_t size = write(ends[1], "x", 1);
    for (;;) pause();
  }
  char opened = 0;
  ASSERT_EQ(read(ends[0], &opened, 1), 1);
  EXPECT_THROW(MapFile(path, MapFile::Access::kRead), MapFileInUse);
  EXPECT_THROW(MapFile(path, MapFile::Access::kUpdate), MapFileInUse);
  EXPECT_THROW(saveMap(path, infoOf(), {}, mapOf(2)), MapFileInUse);
  ::kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(reference::contentOf(loadMap(path).map), reference::contentOf(mapOf(1)));
  close(ends[0]);
  close(ends[1]);
}

}  // namespace
}  // namespace bki_mapping
