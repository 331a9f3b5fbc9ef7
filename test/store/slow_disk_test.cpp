// What arrives from the file after the map has changed: while the disk is slow, the order of all that happens
// is known.
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>

#include "store/kept_mapper.h"
#include "store/watched_disk.h"

namespace bki_mapping {
namespace {

using reference::contentOf;

/// A disk whose next write lasts until it is released.
class HeldDisk {
 public:
  explicit HeldDisk(const std::string& folder)
      : watched_(folder, [this](const DiskCall&) { return pass(); }) {}
  ~HeldDisk() { release(); }

  void hold() {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_ = true;
  }
  void waitForCall() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return waiting_; });
  }
  void release() {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_ = waiting_ = false;
    changed_.notify_all();
  }

 private:
  int pass() {
    std::unique_lock<std::mutex> lock(mutex_);
    waiting_ = held_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !held_; });
    return 0;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool held_ = false, waiting_ = false;
  WatchedDisk watched_;
};

/// A map file about the origin, and a mapper that is far away from there.
class LateArrival : public testing::Test {
 protected:
  static constexpr double kFar = 5000.0;  // [m]

  LateArrival() {
    for (std::uint64_t n = 0; n < 5; ++n) scans_.push_back(scanAt(4.0 * static_cast<double>(n), 0.0, n + 1));
    Kept kept(path_, "before");
    for (const Scan& scan : scans_) kept.integrate(scan, 1000.0);
  }

  void TearDown() override { disk_.release(); }

  /// Opens the file, and keeps its thread busy with a write that does not end.
  void begin() {
    kept_.emplace(path_, "now");
    kept_->integrate(scanAt(kFar, 0.0, 100), 1000.0);
    disk_.hold();
    kept_->keeper.save();
    disk_.waitForCall();
  }
  void integrateHere(std::uint64_t stamp) {
    const Scan scan = scanAt(8.0, 0.0, stamp);
    kept_->mapper.integrate(scan);
    kept_->keeper.addScan(scan.stamp);
    scans_.push_back(scan);
  }
  void moveHere() { kept_->keeper.moveTo({Eigen::Vector3d::Zero(), 1000.0}); }
  void moveAway() { kept_->keeper.moveTo({{kFar, 0.0, 0.0}, 1000.0}); }
  void arrive() {
    disk_.release();
    kept_->keeper.waitForTiles();
  }
  std::map<GridIndex, std::string> contentHere() const { return contentOf(kept_->mapper.map()); }

  TemporaryFolder folder_{memoryFolder()};
  std::string path_ = folder_ / "map.bkm";
  std::vector<Scan> scans_;  ///< about the origin
  HeldDisk disk_{folder_.path()};
  std::optional<Kept> kept_;
};

TEST_F(LateArrival, OfATileThatHasLeftAndComeBackIsOutOfDate) {
  begin();
  moveHere();
  integrateHere(200);
  moveAway();
  moveHere();
  arrive();
  EXPECT_TRUE(same(contentHere(), contentOfAll(scans_)));
}

TEST_F(LateArrival, OfATileThatHasLeftIsNoUse) {
  begin();
  moveHere();
  moveAway();
  arrive();
  EXPECT_TRUE(same(contentHere(), contentOfAll({scanAt(kFar, 0.0, 100)})));
}

TEST_F(LateArrival, FromABoxThatWasClearedIsOutOfDate) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-20.0, -5.0, -3.0), Eigen::Vector3d(9.0, 30.0, 2.0));
  begin();
  moveHere();
  integrateHere(200);
  kept_->keeper.clearBox(box);
  integrateHere(201);
  arrive();
  SemanticMapper expected(configOf(), reference::smallTable());
  for (const Scan& scan : scans_) {
    if (scan.stamp == 201) expected.clearBox(box);
    expected.integrate(scan);
  }
  EXPECT_TRUE(same(contentHere(), contentOf(expected.map())));
}

TEST_F(LateArrival, FromBeforeAResetIsForgotten) {
  ASSERT_EQ(damageATile(path_).size(), 1u);
  begin();
  for (std::uint64_t stamp = 200; stamp < 205; ++stamp) integrateHere(stamp);
  moveHere();
  moveAway();  // evidence for the damaged tile goes to the file, and comes back
  kept_->keeper.reset(newDrive("then"));
  arrive();
  EXPECT_EQ(kept_->mapper.map().size(), 0u);
  EXPECT_EQ(kept_->keeper.close(), "");
  EXPECT_TRUE(contentIn(path_).empty());
}

TEST_F(LateArrival, OfADamagedTileIsForgottenAtAReset) {
  ASSERT_EQ(damageATile(path_).size(), 1u);
  kept_.emplace(path_, "now");
  moveHere();
  kept_->keeper.waitForTiles();
  EXPECT_NE(kept_->keeper.fault().find("damaged"), std::string::npos);
  kept_->keeper.reset(newDrive("then"));
  EXPECT_EQ(kept_->keeper.fault(), "");
  scans_.clear();
  integrateHere(300);
  EXPECT_EQ(kept_->keeper.close(), "");
  EXPECT_TRUE(same(contentIn(path_), contentOfAll(scans_)));
}

TEST_F(LateArrival, IsSavedWithTheRest) {
  begin();
  moveHere();
  integrateHere(200);
  std::future<void> saved = kept_->keeper.save();
  integrateHere(201);
  arrive();
  saved.get();
  moveHere();
  kept_->keeper.waitForTiles();
  EXPECT_TRUE(same(contentHere(), contentOfAll(scans_)));
  EXPECT_EQ(kept_->keeper.close(), "");
  std::vector<Scan> all = scans_;
  all.push_back(scanAt(kFar, 0.0, 100));
  EXPECT_TRUE(same(contentIn(path_), contentOfAll(all)));
}

TEST_F(LateArrival, MakesATileWholeThatBeamsHaveReachedBefore) {
  constexpr double kSmall = 10.0;  // [m]; beams reach tiles that are not yet loaded
  kept_.emplace(path_, "now");
  for (std::uint64_t stamp = 200; stamp < 203; ++stamp) {
    scans_.push_back(scanAt(54.0, 1.0, stamp));
    kept_->integrate(scans_.back(), kSmall);
  }
  kept_->keeper.waitForTiles();
  const GridIndex tile{0, 0, 0};
  ASSERT_TRUE(kept_->mapper.map().hasRegion(tile)) << "beams have not reached it";
  kept_->keeper.moveTo({{20.0, 1.0, 0.0}, kSmall});
  kept_->keeper.waitForTiles();
  const auto expected = contentOfAll(scans_), found = contentHere();
  std::size_t blocks = 0;
  for (const auto& [index, content] : expected) {
    if (!(SemanticMap::regionOf({index}) == tile)) continue;
    ++blocks;
    ASSERT_EQ(found.count(index), 1u);
    EXPECT_TRUE(found.at(index) == content);
  }
  EXPECT_GT(blocks, 30u);
}

TEST(SlowDisk, IsNotUsedWhileTheSensorStands) {
  const TemporaryFolder folder(memoryFolder());
  std::atomic<int> changes{0};
  const WatchedDisk watched(folder.path(), [&](const DiskCall& call) {
    changes += call.kind == DiskCall::Kind::kSync;
    return 0;
  });
  Kept kept(folder / "map.bkm", "a");
  std::vector<Scan> scans;
  for (std::uint64_t n = 0; n < 20; ++n) {
    scans.push_back(scanAt(9.0, 16.0, n + 1));
    kept.integrate(scans.back(), 10.0);  // beams go beyond the window, and beyond its margin
    kept.keeper.waitForTiles();
    if (n == 0) changes = 0;
  }
  EXPECT_EQ(changes, 0);
  EXPECT_EQ(kept.keeper.close(), "");
  EXPECT_GT(changes, 0);
  EXPECT_TRUE(same(contentIn(kept.keeper.path()), contentOfAll(scans)));
}

}  // namespace
}  // namespace bki_mapping
