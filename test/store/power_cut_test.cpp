// Whenever the power fails, and whatever of that which was not synced is then lost, a map file holds
// everything that was reported as stored, and nothing else but a whole number of changes.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <numeric>

#include "bki_mapping/store/map_file.h"
#include "store/file_content.h"
#include "store/map_maker.h"
#include "store/simulated_disk.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

const std::string kName = "map.bkm";

Files filesOf(const std::string& folder) {
  Files files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files[entry.path().filename().string()] = readFile(entry.path().string());
  }
  return files;
}

/// A program that stores a map again and again, recorded; and what is left of its files if the power fails.
class PowerCut : public testing::Test {
 protected:
  /// Notes that the map is stored as it is now.
  void stored(FileContent content) {
    contents_.push_back(std::move(content));
    stored_after_.push_back(calls_.size());
  }
  /// What is stored before the program runs.
  void startWith(const SemanticMap& map) {
    saveMap(path_, infoOf(), {driveOf("a")}, map);
    stored(contentOf(path_));
  }
  void record(const std::function<void()>& program) {
    before_ = filesOf(run_.path());
    const WatchedDisk disk(run_.path(), [&](const DiskCall& call) {
      calls_.push_back(call);
      return 0;
    });
    program();
  }

  /// Cuts the power before each call that the program made to the disk, and after the last one.
  /// @param share of the cuts that are tried; near the end all are.
  void cutEverywhere(double share = 1.0) {
    ASSERT_GT(calls_.size(), 10u) << "the calls were not seen";
    SimulatedDisk disk(run_.path(), before_);
    std::size_t stored = 0;
    for (std::size_t done = 0; done <= calls_.size(); ++done) {
      while (stored < contents_.size() && stored_after_[stored] <= done) ++stored;
      for (const SimulatedDisk::Loss loss : SimulatedDisk::kLosses) {
        const bool near_end = done + 8 > calls_.size();
        if (!near_end && std::uniform_real_distribution<double>()(random_) >= share) continue;
        const Files files = disk.cut(loss, random_);
        const std::string what = "power cut after call " + std::to_string(done) + " of " +
                                 std::to_string(calls_.size()) + ", loss " +
                                 std::to_string(static_cast<int>(loss));
        check(files, stored, what);
        if (random_() % 8 == 0) cutRecovery(files, stored, what);
        if (HasFailure()) return;
      }
      if (done < calls_.size()) disk.apply(calls_[done]);
    }
    EXPECT_GT(found_older_, 0u);
    EXPECT_GT(found_newer_, 0u);
  }

  TemporaryFolder run_{std::filesystem::canonical(memoryFolder())};
  const std::string path_ = run_ / kName;
  std::mt19937 random_{1};
  bool may_be_damaged_ = false;

 private:
  void restore(const Files& files) {
    for (const auto& entry : std::filesystem::directory_iterator(after_.path()))
      std::filesystem::remove(entry);
    for (const auto& [name, bytes] : files) writeFile(after_ / name, bytes);
  }
  /// @param stored number of contents that were stored: that with this number may be, too.
  void check(const Files& files, std::size_t stored, const std::string& what) {
    restore(files);
    if (files.count(kName) == 0) {
      EXPECT_EQ(stored, 0u) << what << ": there is no file";
      return;
    }
    try {
      const FileContent content = contentOf(after_ / kName);
      const bool older = stored > 0 && content == contents_[stored - 1];
      const bool newer = stored < contents_.size() && content == contents_[stored];
      EXPECT_TRUE(older || newer) << what;
      found_older_ += older;
      found_newer_ += newer;
    } catch (const MapFileError& error) {
      // What could not be read before it was to be replaced:
      const bool unchanged = may_be_damaged_ && stored == 0 && files.at(kName) == before_.at(kName);
      EXPECT_TRUE(unchanged) << what << ": " << error.what();
      found_older_ += unchanged;
    }
  }
  /// Cuts the power once more while the file is opened again.
  void cutRecovery(const Files& files, std::size_t stored, const std::string& what) {
    restore(files);
    std::vector<DiskCall> calls;
    {
      const WatchedDisk watched(after_.path(), [&](const DiskCall& call) {
        calls.push_back(call);
        return 0;
      });
      sentenceOf([&] {
        MapFile(after_ / kName, random_() % 2 ? MapFile::Access::kRead : MapFile::Access::kUpdate);
      });
    }
    SimulatedDisk disk(after_.path(), files);
    const std::size_t done = random_() % (calls.size() + 1);
    for (std::size_t c = 0; c < done; ++c) disk.apply(calls[c]);
    check(disk.cut(SimulatedDisk::kLosses[random_() % std::size(SimulatedDisk::kLosses)], random_), stored,
          what + ", and again after call " + std::to_string(done) + " of " + std::to_string(calls.size()));
  }

  TemporaryFolder after_{std::filesystem::canonical(memoryFolder())};
  Files before_;
  std::vector<DiskCall> calls_;
  std::vector<FileContent> contents_;
  std::vector<std::size_t> stored_after_;  ///< the number of calls before each content was reported as stored
  std::size_t found_older_ = 0, found_newer_ = 0;
};

TEST_F(PowerCut, LosesNoChangeOfAFile) {
  startWith(randomMap(1, 20));
  const auto write = [&](MapFile& file, const SemanticMap& map, unsigned drive) {
    MapFile::Change change = file.change();
    for (const GridIndex& tile : tilesOf(map)) change.writeTile(map, {tile});
    change.putDrive(driveOf("drive " + std::to_string(drive), static_cast<int>(drive)));
    change.commit();
    stored(contentOf(file));
  };
  record([&] {
    for (unsigned session = 0; session < 2; ++session) {
      MapFile file(path_, MapFile::Access::kUpdate);
      write(file, randomMap(2 + session, 20), session);
      write(file, randomMap(4 + session, 40), session);
      {
        MapFile::Change lost = file.change();
        lost.writeTile(randomMap(9), {{0, 0, 0}});
      }
      MapFile::Change change = file.change();
      for (const TileEntry& tile : file.tiles()) {
        if (tile.index.x < 0) change.eraseTile({tile.index});
      }
      change.eraseDrive("drive 0");
      change.commit();
      stored(contentOf(file));
    }
  });
  cutEverywhere(0.2);
}

// More than SQLite keeps in memory: it writes to the file before the change is complete.
TEST_F(PowerCut, LosesNoLargeChange) {
  startWith(randomMap(1, 1200, 20));
  record([&] {
    MapFile file(path_, MapFile::Access::kUpdate);
    const SemanticMap map = randomMap(2, 1200, 20);
    MapFile::Change change = file.change();
    for (const GridIndex& tile : tilesOf(map)) change.writeTile(map, {tile});
    change.commit();
    stored(contentOf(file));
  });
  cutEverywhere(0.003);
}

TEST_F(PowerCut, LosesNoFileThatReplacesAnother) {
  startWith(randomMap(1, 20));
  record([&] {
    for (unsigned seed = 2; seed < 4; ++seed) {
      saveMap(path_, infoOf(), {driveOf("a")}, randomMap(seed, 20));
      stored(contentOf(path_));
    }
  });
  cutEverywhere();
}

// The journal of a map that nobody can read any more must not be applied to the map that replaces it.
TEST_F(PowerCut, LosesNoFileThatReplacesADamagedOne) {
  saveMap(path_, infoOf(), {}, randomMap(1, 20));
  Files left;
  {
    const WatchedDisk disk(run_.path(), [&](const DiskCall& call) {
      if (left.empty() && call.kind == DiskCall::Kind::kWrite && call.path == path_)
        left = filesOf(run_.path());
      return 0;
    });
    MapFile file(path_, MapFile::Access::kUpdate);
    MapFile::Change change = file.change();
    for (const GridIndex& tile : tilesOf(randomMap(2, 20))) change.writeTile(randomMap(2, 20), {tile});
    change.commit();
  }
  ASSERT_EQ(left.size(), 2u) << "there is no journal";
  for (auto& [name, bytes] : left) {
    if (name == kName) bytes[0] = 'x';
    writeFile(run_ / name, bytes);
  }
  record([&] {
    saveMap(path_, infoOf(), {driveOf("a")}, randomMap(3, 20));
    stored(contentOf(path_));
  });
  may_be_damaged_ = true;
  cutEverywhere();
}

TEST_F(PowerCut, LosesNoNewFile) {
  record([&] {
    MapFile file = MapFile::create(path_, infoOf());
    stored(contentOf(file));
    MapFile::Change change = file.change();
    change.writeTile(randomMap(1, 20), {{0, 0, 0}});
    change.commit();
    stored(contentOf(file));
  });
  cutEverywhere();
}

}  // namespace
}  // namespace bki_mapping
