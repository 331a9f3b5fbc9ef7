// A disk that is full, that must not be written to or that fails is named in one sentence; the file stays as
// it was, and all goes on when the fault is gone.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>

#include "bki_mapping/store/map_file.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "store/simulated_disk.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kForGood = std::numeric_limits<std::size_t>::max();
const std::string kName = "map.bkm";

/// Calls to the disk that fail.
struct Faults {
  int reason;
  std::size_t first, count;

  std::string text() const {
    return std::to_string(count) + " calls after " + std::to_string(first) + " fail with " +
           std::to_string(reason);
  }
};

class FaultyDisk : public testing::Test {
 protected:
  FaultyDisk() { saveMap(path_, infoOf(), {driveOf("a")}, before_); }

  /// Runs a program on a disk with faults. @param[in,out] synced gets the calls that did not fail. @return
  /// the number of calls.
  std::size_t run(const std::function<void()>& program, const Faults& faults,
                  SimulatedDisk* synced = nullptr) {
    std::size_t calls = 0;
    const WatchedDisk disk(folder_.path(), [&](const DiskCall& call) {
      const std::size_t number = calls++;
      if (number >= faults.first && number - faults.first < faults.count) return faults.reason;
      if (synced) synced->apply(call);
      return 0;
    });
    program();
    return calls;
  }
  /// Calls visit(faults) for faults of many kinds. @param calls number of calls that can fail.
  static void forAllFaults(std::size_t calls, const std::function<void(const Faults&)>& visit) {
    ASSERT_GT(calls, 10u);
    for (const int reason : {ENOSPC, EIO, EACCES}) {
      for (const std::size_t count : {std::size_t{1}, std::size_t{8}, kForGood}) {
        for (std::size_t first = 0; first < calls; ++first) visit({reason, first, count});
      }
    }
  }
  void change(MapFile& file) const {
    MapFile::Change change = file.change();
    for (const TileEntry& tile : file.tiles()) change.eraseTile({tile.index});
    for (const GridIndex& tile : tilesOf(after_)) change.writeTile(after_, {tile});
    change.putDrive(driveOf("b"));
    change.commit();
  }
  static void expectDurable(const SimulatedDisk& disk, const FileContent& content, const std::string& what) {
    const TemporaryFolder folder(memoryFolder());
    std::mt19937 unused;
    for (const auto& [name, bytes] : disk.cut(SimulatedDisk::Loss::kEverything, unused)) {
      writeFile(folder / name, bytes);
    }
    EXPECT_TRUE(contentOf(folder / kName) == content) << what << ", and then the power";
  }
  static void expectSentence(const std::string& sentence, const std::string& path, const std::string& what) {
    EXPECT_EQ(sentence.rfind(path + " cannot be ", 0), 0u) << what << ": " << sentence;
    EXPECT_NE(sentence.find("; check "), std::string::npos) << what << ": " << sentence;
  }

  TemporaryFolder folder_{fs::canonical(memoryFolder())};
  const std::string path_ = folder_ / kName;
  const SemanticMap before_ = randomMap(1, 15), after_ = randomMap(2, 25);
};

TEST_F(FaultyDisk, ChangesNothingInAnOpenFile) {
  const std::string original = readFile(path_);
  const FileContent before = contentOf(path_);
  std::size_t calls = 0;
  {
    MapFile file(path_, MapFile::Access::kUpdate);
    calls = run([&] { change(file); }, {});
  }
  const FileContent after = contentOf(path_);
  enum class Outcome { kDone, kFailed, kDoneLate };
  const auto try_change = [&](MapFile& file, const std::string& what) {
    try {
      change(file);
      return Outcome::kDone;
    } catch (const MapFileLateCommit&) {
      return Outcome::kDoneLate;
    } catch (const MapFileError& error) {
      expectSentence(error.what(), path_, what);
      return Outcome::kFailed;
    }
  };
  std::size_t done = 0, late = 0;
  forAllFaults(calls, [&](const Faults& faults) {
    const std::string what = faults.text();
    writeFile(path_, original);
    {
      MapFile file(path_, MapFile::Access::kUpdate);
      SimulatedDisk disk(folder_.path(), {{kName, original}});
      Outcome outcome{};
      run([&] { outcome = try_change(file, what); }, faults, &disk);
      const bool made = contentOf(file) == after;
      if (made && outcome == Outcome::kFailed) {
        outcome = try_change(file, what);
        EXPECT_TRUE(outcome == Outcome::kDoneLate) << what;
        ++late;
      } else {
        EXPECT_EQ(made, outcome == Outcome::kDone) << what;
        EXPECT_TRUE(made || contentOf(file) == before) << what;
      }
      if (outcome == Outcome::kDone) {
        ++done;
        expectDurable(disk, after, what);
      }
      EXPECT_EQ(sentenceOf([&] { change(file); }), "") << what;
      EXPECT_TRUE(contentOf(file) == after) << what;
    }
    EXPECT_TRUE(contentOf(path_) == after) << what;
  });
  EXPECT_GT(done, 0u);
  EXPECT_GT(late, 0u);
}

TEST_F(FaultyDisk, ReplacesNoFile) {
  const FileContent before = contentOf(path_);
  const auto save = [&] { saveMap(path_, infoOf(), {driveOf("b")}, after_); };
  const std::size_t calls = run(save, {});
  const FileContent after = contentOf(path_);
  std::size_t failed = 0;
  forAllFaults(calls, [&](const Faults& faults) {
    saveMap(path_, infoOf(), {driveOf("a")}, before_);
    std::string sentence;
    SimulatedDisk disk(folder_.path(), {{kName, readFile(path_)}});
    run([&] { sentence = sentenceOf(save); }, faults, &disk);
    const FileContent now = contentOf(path_);
    if (sentence.empty()) {
      EXPECT_TRUE(now == after) << faults.text();
      // Where a folder cannot be synced for another reason than a fault of the disk, it need not be.
      if (faults.reason != EACCES) expectDurable(disk, after, faults.text());
    } else {
      expectSentence(sentence, path_, faults.text());
      // The last call syncs the folder: the name then stands for the new file already.
      EXPECT_TRUE(now == before || (faults.first + 1 == calls && now == after)) << faults.text();
      ++failed;
    }
    EXPECT_EQ(sentenceOf(save), "") << faults.text();
    EXPECT_TRUE(contentOf(path_) == after) << faults.text();
    // What could not be removed then is, later, by another process.
    if (faults.count == 1) {
      EXPECT_EQ(folder_.fileCount(), 1u) << faults.text();
    }
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      if (entry.path() != path_) fs::remove(entry);
    }
  });
  EXPECT_GT(failed, calls);
}

/// Runs a program in a process of its own. @return what it says, or what its MapFileError says.
std::string inAProcess(const std::function<std::string()>& program) {
  int ends[2];
  EXPECT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    std::string text;
    const std::string fault = sentenceOf([&] { text = program(); });
    text += fault;
    [[maybe_unused]] const ssize_t size = write(ends[1], text.data(), text.size());
    _exit(0);
  }
  close(ends[1]);
  std::string text(10'000, '\0');
  std::size_t size = 0;
  for (ssize_t more = 0; (more = read(ends[0], &text[size], text.size() - size)) > 0;)
    size += static_cast<std::size_t>(more);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  return text.substr(0, size);
}

TEST_F(FaultyDisk, MayLimitTheSizeOfFiles) {
  const FileContent before = contentOf(path_);
  const std::size_t size = readFile(path_).size();
  const auto limited = [&](const std::function<void()>& program) {
    return inAProcess([&] {
      signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{size, size};
      setrlimit(RLIMIT_FSIZE, &limit);
      program();
      return std::string("it was written");
    });
  };
  expectSentence(limited([&] { saveMap(path_, infoOf(), {}, randomMap(1, 100)); }), path_, "replaced");
  expectSentence(limited([&] {
                   MapFile file(path_, MapFile::Access::kUpdate);
                   MapFile::Change change = file.change();
                   const SemanticMap map = randomMap(1, 100);
                   for (const GridIndex& tile : tilesOf(map)) change.writeTile(map, {tile});
                   change.commit();
                 }),
                 path_, "changed");
  EXPECT_TRUE(contentOf(path_) == before);
  EXPECT_EQ(folder_.fileCount(), 1u);
}

/// As a user who has no rights beyond those of the files.
std::string asAUser(const std::function<std::string()>& program) {
  return inAProcess([&]() -> std::string {
    constexpr uid_t kNobody = 65534;
    if (geteuid() == 0 && (setgid(kNobody) != 0 || setuid(kNobody) != 0)) return "rights cannot be given up";
    return program();
  });
}

TEST_F(FaultyDisk, MayBeForReadingOnly) {
  const FileContent before = contentOf(path_);
  const auto read = [&] { return std::string(contentOf(path_) == before ? "read" : "read something else"); };
  const auto update = [&] {
    MapFile(path_, MapFile::Access::kUpdate);  // not only when something is written
    return std::string("opened");
  };
  const auto save = [&] {
    saveMap(path_, infoOf(), {}, after_);
    return std::string("saved");
  };
  struct Rights {
    mode_t folder, file;
  };
  for (const Rights& rights : {Rights{0555, 0666}, Rights{0777, 0444}, Rights{0555, 0444}}) {
    const std::string what = std::to_string(rights.folder) + " " + std::to_string(rights.file);
    chmod(path_.c_str(), rights.file);
    chmod(folder_.path().c_str(), rights.folder);
    EXPECT_EQ(asAUser(read), "read") << what;
    expectSentence(asAUser(update), path_, what);
    if (rights.folder == 0555) expectSentence(asAUser(save), path_, what);
    EXPECT_TRUE(contentOf(path_) == before) << what;
    EXPECT_EQ(folder_.fileCount(), 1u) << what;
  }
  chmod(folder_.path().c_str(), 0777);
  chmod(path_.c_str(), 0);
  expectSentence(asAUser(read), path_, "no rights");
}

// A journal must be applied before a file is read, which is writing.
TEST_F(FaultyDisk, MayBeForReadingOnlyAfterAKill) {
  Files left;
  {
    MapFile file(path_, MapFile::Access::kUpdate);
    const WatchedDisk disk(folder_.path(), [&](const DiskCall& call) {
      if (left.empty() && call.kind == DiskCall::Kind::kWrite && call.path == path_) {
        for (const std::string& name : {kName, kName + "-journal"}) left[name] = readFile(folder_ / name);
      }
      return 0;
    });
    change(file);
  }
  for (const auto& [name, bytes] : left) {
    writeFile(folder_ / name, bytes);
    chmod((folder_ / name).c_str(), 0444);
  }
  chmod(folder_.path().c_str(), 0555);
  expectSentence(asAUser([&] { return textOf(MapFile(path_, MapFile::Access::kRead).info()); }), path_,
                 "journal");
  chmod(folder_.path().c_str(), 0777);
}

}  // namespace
}  // namespace bki_mapping
