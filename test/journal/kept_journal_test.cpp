// A map file with a journal holds each of its scans exactly once, at the pose that the journal says, whenever
// the process is killed.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <random>

#include "journal/journal_writer.h"
#include "journal/scan_codec.h"
#include "journal/stored_settings.h"
#include "store/kept_mapper.h"

namespace bki_mapping {
namespace {

MapperConfig config(bool rules = false) {
  MapperConfig config = configOf();
  config.threads = 1;
  config.rules.enabled = rules;
  if (rules) config.sensor_model.height = 1.5;
  return config;
}

Eigen::Isometry3d poseAt(double x, double y, double yaw) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, 0.3);
  return pose;
}

/// A mapper with a journal in a file, as the node has it.
class Journalled {
 public:
  Journalled(const std::string& path, const std::string& drive, const MapperConfig& config)
      : mapper_(config, reference::smallTable()),
        keeper_(mapper_, path, infoOfMapper(mapper_), newDrive(drive), true),
        writer_(keeper_.journalSize(), drive, reference::smallTable()),
        corrector_(config, reference::smallTable(), settings(),
                   {[this](SemanticMap difference) {
                      keeper_.change(std::move(difference));
                      return std::vector<GridIndex>();
                    },
                    [this](const GridIndex& tile, const LooksByBlock& looks) {
                      return keeper_.replaceLooks(tile, looks);
                    },
                    {},
                    [this](std::uint64_t number) {
                      ++fetched_;
                      return keeper_.scanContent(writer_.fileNumber(number));
                    }}) {
    corrector_.noteForeign(keeper_.storedTiles());
    keeper_.keepJournal([this] { return writer_.take(corrector_, {"lidar"}); });
  }
  ~Journalled() { keeper_.close(); }

  /// Step n of a drive out and back: a scan, and now and then a correction, a cleared box, or a save.
  void step(unsigned n, unsigned seed) {
    std::mt19937 random(seed + n);
    const double x = n < 40 ? 4.0 * n : 4.0 * (80 - n);
    const Eigen::Isometry3d pose = poseAt(x, n < 40 ? 0.0 : 2.0, 0.02 * n);
    Scan scan = scanAt(0.0, 0.0, 1'000'000'000 + 100'000'000ull * n);
    scan.origin = pose.translation();
    const RoundedScan rounded = corrector_.round(scan, pose);
    mapper_.integrate(place(rounded.scan, rounded.T_map_sensor));
    corrector_.addScan(rounded.scan, 0, rounded.T_map_sensor, pose, mapper_.touchedBlocks());
    keeper_.addScan(scan.stamp);
    odometry_.push_back({scan.stamp, pose});
    if (random() % 10 == 0) {
      std::vector<StampedMotion> keyframes;
      for (std::size_t k = 0; k < odometry_.size(); k += 1 + random() % 6) {
        const double shift = 0.1 * static_cast<double>(random() % 20);
        keyframes.push_back({odometry_[k].stamp, poseAt(shift, -shift, 0.01 * shift) * odometry_[k].motion});
      }
      corrector_.correct(keyframes, {Eigen::Isometry3d::Identity()});
    }
    if (random() % 15 == 0) {
      const Eigen::Vector3d low(x - 10.0 + static_cast<double>(random() % 10), -5.0, -1.0);
      const Eigen::AlignedBox3d box(low, low + Eigen::Vector3d(6.0, 8.0, 3.0));
      corrector_.noteCleared(box);
      keeper_.clearBox(box);
    }
    for (auto k = random() % 3; k > 0; --k) update(pose);
    if (random() % 7 == 0) saves_.push_back(keeper_.save());
    update(pose);
  }
  void finish() {
    corrector_.finish(Eigen::Vector3d::Zero());
    keeper_.save().get();
    EXPECT_GT(fetched_, 20) << "scans that are not in memory have moved";
    EXPECT_LT(corrector_.progress().bytes, 20'000u);
    EXPECT_EQ(corrector_.progress().forgotten, 0u);
    EXPECT_EQ(corrector_.progress().failed, 0u);
  }

 private:
  static MapCorrector::Settings settings() {
    MapCorrector::Settings settings;
    settings.quantum = 0.02;
    settings.tolerance = 0.0;
    settings.memory = 20'000;  // some scans; the others are in the file
    return settings;
  }
  void update(const Eigen::Isometry3d& pose) {
    corrector_.update(pose.translation());
    keeper_.moveTo({pose.translation(), kWindow});
  }

  SemanticMapper mapper_;
  MapKeeper keeper_;
  JournalWriter writer_;
  std::vector<StampedMotion> odometry_;
  std::vector<std::future<void>> saves_;
  std::atomic<int> fetched_{0};
  MapCorrector corrector_;
};

/// The map of the scans in the journal of a file, at the poses there.
SemanticMap mapOfJournal(MapFile& file) {
  SemanticMap sum = file.info().emptyMap();
  const std::vector<Eigen::AlignedBox3d> boxes = file.clearedBoxes();
  std::vector<std::unique_ptr<SemanticMapper>> mappers;
  for (const auto& settings : journalSettings(file)) {
    mappers.push_back(std::make_unique<SemanticMapper>(*settings, reference::smallTable()));
  }
  for (const ScanRecord& scan : file.scans()) {
    SemanticMapper& mapper = *mappers.at(static_cast<std::size_t>(scan.settings));
    mapper.integrate(place(unpackScan(file.scanContent(scan.number)), scan.T_map_sensor));
    const std::vector<GridIndex> tiles = tilesOf(mapper.map());
    EXPECT_TRUE(std::includes(scan.tiles.begin(), scan.tiles.end(), tiles.begin(), tiles.end()));
    for (std::size_t b = static_cast<std::size_t>(scan.cleared); b < boxes.size(); ++b) {
      mapper.clearBox(boxes[b]);
    }
    sum.add(mapper.takeMap());
  }
  return sum;
}

/// The evidence of a map, without looks.
std::map<GridIndex, std::string> evidenceOf(const SemanticMap& map) {
  SemanticMap plain(map.geometry(), map.prior(), map.classCount());
  for (const auto& [index, block] : map.entries()) {
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      plain.getOrAllocate(index).add(block->classes()[p], block->plane(p));
    }
  }
  return reference::contentOf(plain);
}

/// Holds the law for a file. @return its number of scans.
std::size_t expectWhole(const std::string& path, bool looks) {
  MapFile file(path, MapFile::Access::kRead);
  std::uint64_t scans = 0;
  for (const DriveRecord& drive : file.drives()) scans += drive.scans;
  EXPECT_EQ(file.scans().size(), scans);
  const SemanticMap wanted = mapOfJournal(file);
  const StoredMap found = readMap(file);
  EXPECT_TRUE(same(evidenceOf(found.map), evidenceOf(wanted)));
  if (looks) {
    EXPECT_TRUE(same(reference::contentOf(found.map), reference::contentOf(wanted)));
  }
  return static_cast<std::size_t>(scans);
}

class KeptJournal : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(WithRulesAndLooks, KeptJournal, testing::Bool());

TEST_P(KeptJournal, HoldsEachScanOnce) {
  const TemporaryFolder folder(memoryFolder());
  const std::string path = folder / "map.bkm";
  std::size_t scans = 0;
  for (const std::string drive : {"first", "second"}) {
    {
      Journalled map(path, drive, config(GetParam()));
      for (unsigned n = 0; n < 80; ++n) map.step(n, drive == "first" ? 100 : 300);
      map.finish();
    }
    scans += 80;
    EXPECT_EQ(expectWhole(path, GetParam() && drive == "first"), scans);
  }
  MapFile file(path, MapFile::Access::kRead);
  EXPECT_EQ(file.scans()[0].drive, "first");
  EXPECT_EQ(file.scans()[159].drive, "second");
  EXPECT_EQ(file.scans()[159].sensor, "lidar");
  EXPECT_GT(file.clearedBoxes().size(), 0u);
}

TEST(KeptJournal, HoldsEachScanOnceWhenItIsKilled) {
  const TemporaryFolder folder(memoryFolder());
  std::mt19937 random(5);
  std::size_t seen = 0, cut_short = 0;
  for (int round = 0; round < 30; ++round) {
    const std::string path = folder / ("map" + std::to_string(round / 3) + ".bkm");
    const std::string drive = std::to_string(round % 3);
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      close(ends[0]);
      try {
        Journalled map(path, drive, config());
        for (unsigned n = 0; n < 80; ++n) {
          map.step(n, 1000 * static_cast<unsigned>(round));
          [[maybe_unused]] const ssize_t size = write(ends[1], &n, sizeof n);
        }
        raise(SIGKILL);
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
      }
      _exit(1);
    }
    close(ends[1]);
    const unsigned last = 10 + static_cast<unsigned>(random() % 70);
    unsigned n = 0;
    while (n < last && read(ends[0], &n, sizeof n) == sizeof n) continue;
    usleep(static_cast<useconds_t>(random() % 20000));  // the moment is the matter of the test
    kill(child, SIGKILL);
    close(ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << status;
    const std::size_t before = round % 3 == 0 ? 0 : seen;
    seen = expectWhole(path, false);
    EXPECT_GE(seen, before);
    cut_short += seen - before < n + 1u;
  }
  EXPECT_GT(cut_short, 10u) << "the kills come in the middle of changes";
}

/// The numbers of the scans in a change that say that the poses jump before them.
std::vector<std::uint64_t> jumpsIn(const JournalChange& change) {
  std::vector<std::uint64_t> numbers;
  for (const JournalChange::Added& each : change.added) {
    if (each.scan.jump) numbers.push_back(each.scan.number);
  }
  for (const ScanRecord& scan : change.moved) {
    if (scan.jump) numbers.push_back(scan.number);
  }
  return numbers;
}

TEST(JournalWriter, TellsOfJumpsThatAreNoticedLate) {
  MapCorrector corrector(config(), reference::smallTable(), {},
                         {[](SemanticMap) { return std::vector<GridIndex>(); },
                          [](const GridIndex&, const LooksByBlock&) { return std::vector<GridIndex>(); }});
  JournalWriter writer({10, 0, 0}, "drive", reference::smallTable());
  const auto add = [&](std::uint64_t stamp) {
    Scan scan = scanAt(0.0, 0.0, stamp);
    scan.origin.setZero();
    const Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    corrector.addScan(corrector.round(scan, pose).scan, 0, pose, pose, {});
  };
  for (const std::uint64_t stamp : {100u, 200u, 300u, 400u}) add(stamp);
  EXPECT_EQ(writer.take(corrector, {}).added.size(), 4u);
  corrector.noteJump(250);
  corrector.noteJump(500);
  EXPECT_EQ(jumpsIn(writer.take(corrector, {})), std::vector<std::uint64_t>{12}) << "the scan of time 300";
  add(600);
  add(510);
  EXPECT_EQ(jumpsIn(writer.take(corrector, {})), std::vector<std::uint64_t>{15}) << "the scan of time 510";
  EXPECT_TRUE(jumpsIn(writer.take(corrector, {})).empty());
}

TEST(KeptJournal, IsRefusedByFilesOfOlderVersions) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  std::filesystem::copy_file(BKI_MAPPING_SOURCE_DIR "/test/store/data/version_3.bkm", path);
  std::filesystem::permissions(path, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  MapInfo info = MapFile(path, MapFile::Access::kRead).info();
  MapperConfig config = configOf();
  config.resolution = info.resolution;
  config.prior = info.prior;
  SemanticMapper mapper(config, info.classes);
  EXPECT_EQ(
      sentenceOf([&] { MapKeeper(mapper, path, info, newDrive("a"), true); }),
      path +
          " is of a version of the format that has no journal of scans; convert it with migrate_map, or do "
          "without the journal");
}

}  // namespace
}  // namespace bki_mapping
