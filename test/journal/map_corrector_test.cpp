// The law of corrections: the map is, to the bit, that of the scans at their corrected poses.
#include "journal/map_corrector.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <thread>

#include "journal/corrected.h"

namespace bki_mapping {
namespace {

TEST(MapCorrector, TheMapIsThatOfTheCorrectedPoses) {
  for (const auto& [name, config] : configs()) expectTheMapOfTheCorrectedPoses(name, config);
}

/// Poses a to d of a straight way, and a path that moves them to the left by a metre each.
struct Way {
  Keyframes odometry, moved;
};
Way way(std::size_t count, double metres) {
  Way way;
  for (std::size_t n = 0; n < count; ++n) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(static_cast<double>(n), 0.0, 0.0);
    way.odometry.push_back({1'000'000'000 + 100'000'000 * n, pose});
    pose.translation().y() = metres;
    way.moved.push_back({way.odometry.back().stamp, pose});
  }
  return way;
}

TEST(MapCorrector, EachScanIsInTheMapOnceAtAnyMoment) {
  MapperConfig config;
  config.free_space.mode = "line";
  std::mt19937 random(12);
  Corrected map(config);
  const Way poses = way(9, 1.0);
  for (const StampedMotion& pose : poses.odometry)
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  map.finish();  // packs
  const std::vector<Eigen::Isometry3d> old_poses = map.poses_;
  map.correct(poses.moved);
  std::size_t between = 0;
  for (;;) {
    map.corrector_.update(Eigen::Vector3d::Zero());
    const MapCorrector::Progress progress = map.corrector_.progress();
    // The newest come first, as all are near: the rest is at its old pose.
    SemanticMapper expected(config, reference::tableWithDynamicClass());
    for (std::size_t n = 0; n < map.scans_.size(); ++n) {
      expected.integrate(place(map.scans_[n], n < progress.to_go ? old_poses[n] : map.poses_[n]));
    }
    ASSERT_TRUE(reference::contentOf(expected.map()) == map.content());
    between += progress.to_go > 0 && progress.to_go < map.scans_.size();
    if (progress.to_go == 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GT(between, 0u);
}

TEST(MapCorrector, MovesWaitWhereTheMapMayNotChange) {
  std::mt19937 random(20);
  Corrected map(withRules());
  const Way poses = way(9, 1.0);
  for (const StampedMotion& pose : poses.odometry)
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  const auto before = map.content();
  map.correct(poses.moved);
  for (int n = 0; n < 200; ++n) {
    EXPECT_TRUE(map.corrector_.update(Eigen::Vector3d::Zero(), false).empty());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(map.corrector_.progress().moved, 0u);
  EXPECT_TRUE(map.content() == before);
  // One job of several scans at once, however many are ready.
  while (map.corrector_.progress().moved == 0) map.corrector_.update(Eigen::Vector3d::Zero());
  EXPECT_LT(map.corrector_.progress().moved, 4u);
  map.finish();
  EXPECT_TRUE(map.content() == map.wanted(random));
}

TEST(MapCorrector, ItsThreadWaitsWhileAScanIsMappedIfTheMapperNeedsAllCores) {
  MapperConfig config;
  config.threads = 0;
  std::mt19937 random(21);
  Corrected map(config);
  const Way poses = way(4, 1.0);
  for (const StampedMotion& pose : poses.odometry)
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  map.finish();  // packs
  map.correct(poses.moved);
  ASSERT_NE(map.corrector_.gate(), nullptr);
  {
    const auto begin = std::chrono::steady_clock::now();
    const Gate::Closed closed(map.corrector_.gate());
    while (std::chrono::steady_clock::now() < begin + Gate::kMostWait / 2) {
      map.corrector_.update(Eigen::Vector3d::Zero());
      // A machine that stood still proves nothing.
      if (std::chrono::steady_clock::now() < begin + Gate::kMostWait * 9 / 10) {
        ASSERT_EQ(map.corrector_.progress().moved, 0u);
      }
    }
  }
  map.finish();
  EXPECT_TRUE(map.content() == map.wanted(random));
  config.threads = 1;
  map.corrector_.reconfigure(config);
  EXPECT_EQ(map.corrector_.gate() == nullptr, std::thread::hardware_concurrency() > 1);
}

/// As on a robot that stands still: each scan sees the regions whose looks are made.
TEST(MapCorrector, WhatIsAroundBecomesRightWhileScansCome) {
  std::mt19937 random(22);
  Corrected map(withRules());
  const Way poses = way(6, 0.5);
  for (const StampedMotion& pose : poses.odometry)
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  map.correct(poses.moved);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const Eigen::Isometry3d& last = poses.odometry.back().motion;
  std::uint64_t stamp = poses.odometry.back().stamp;
  while (!map.corrector_.progress().done && std::chrono::steady_clock::now() < end) {
    stamp += 100'000'000;
    map.add(roomScan(last, stamp, random), last, last);
    map.corrector_.update(Eigen::Vector3d::Zero());
    for (int n = 0; n < 5; ++n) {
      std::this_thread::sleep_for(std::chrono::milliseconds(map.scans_.size()));  // until the thread keeps up
      map.corrector_.update(Eigen::Vector3d::Zero(), false);
    }
  }
  EXPECT_TRUE(map.corrector_.progress().done);
}

TEST(MapCorrector, WhatIsAroundTheRobotIsRightFirst) {
  std::mt19937 random(17);
  Corrected map(withRules());
  const Keyframes moved = addStreet(map, 30, random);
  map.finish();  // packs
  EXPECT_TRUE(map.corrector_.progress().done_around);
  map.correct(moved);
  EXPECT_FALSE(map.corrector_.progress().done_around);
  const Eigen::Vector3d robot = moved[20].motion.translation();
  while (!map.corrector_.progress().done_around) {
    map.corrector_.update(robot);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GT(map.corrector_.progress().to_go, 10u);
  EXPECT_FALSE(map.corrector_.progress().done);
  const GridGeometry& geometry = map.mapper_.map().geometry();
  const auto around = [&](std::map<GridIndex, std::string> blocks) {
    for (auto block = blocks.begin(); block != blocks.end();) {
      const Eigen::Vector3d centre = geometry.blockCentre({block->first});
      block = (centre - robot).norm() < 30.0 ? std::next(block) : blocks.erase(block);
    }
    return blocks;
  };
  EXPECT_GT(around(map.content()).size(), 100u);
  EXPECT_TRUE(around(map.content()) == around(map.wanted(random)));
  map.finish();
  EXPECT_TRUE(map.content() == map.wanted(random));
}

TEST(MapCorrector, ScansWithinTheToleranceStayUntilTheyAreFartherOff) {
  MapCorrector::Settings settings;
  settings.tolerance = 0.1;
  std::mt19937 random(13);
  Corrected map(MapperConfig(), settings);
  const Way poses = way(3, 0.06), farther = way(3, 0.12);
  for (const StampedMotion& pose : poses.odometry)
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  const auto before = map.content();
  map.correct(poses.moved);
  map.finish();
  EXPECT_EQ(map.corrector_.progress().moved, 0u);
  EXPECT_NEAR(map.corrector_.progress().largest_move, 0.06, 1e-6);
  EXPECT_TRUE(map.content() == before);
  map.correct(farther.moved);
  map.finish();
  EXPECT_EQ(map.corrector_.progress().moved, 3u);
  EXPECT_TRUE(map.content() == map.wanted(random));
}

TEST(MapCorrector, AClearedBoxStaysEmptyOfWhatWasBefore) {
  std::mt19937 random(14);
  Corrected map(withRules(false));
  const Way poses = way(6, 0.4);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1.0, -3.0, -3.0), Eigen::Vector3d(2.0, 3.0, 3.0));
  const auto add = [&](std::size_t n) {
    map.add(roomScan(poses.odometry[n].motion, poses.odometry[n].stamp, random), poses.odometry[n].motion,
            poses.odometry[n].motion);
  };
  for (std::size_t n = 0; n < 3; ++n) add(n);
  map.mapper_.clearBox(box);
  map.corrector_.noteCleared(box);
  for (std::size_t n = 3; n < 6; ++n) add(n);
  map.correct(poses.moved);
  map.finish();
  SemanticMapper before(withRules(false), reference::tableWithDynamicClass());
  for (std::size_t n = 0; n < 3; ++n) before.integrate(place(map.scans_[n], map.poses_[n]));
  before.clearBox(box);
  for (std::size_t n = 3; n < 6; ++n) before.integrate(place(map.scans_[n], map.poses_[n]));
  EXPECT_TRUE(map.content() == reference::contentOf(before.map()));
}

TEST(MapCorrector, ForgottenScansStayWhereTheyAre) {
  MapCorrector::Settings settings = exactSettings();
  settings.memory = 3000;
  std::mt19937 random(15);
  MapperConfig config;
  config.free_space.mode = "line";
  Corrected map(config, settings);
  const Way poses = way(8, 1.0);
  for (const StampedMotion& pose : poses.odometry) {
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
    map.finish();
  }
  const MapCorrector::Progress progress = map.corrector_.progress();
  ASSERT_GT(progress.forgotten, 0u);
  ASSERT_GT(progress.scans, 1u);
  EXPECT_EQ(progress.scans + progress.forgotten, 8u);
  EXPECT_LE(progress.bytes, 3000u);
  const std::vector<Eigen::Isometry3d> old_poses = map.poses_;
  map.correct(poses.moved);
  map.finish();
  for (std::size_t n = 0; n < progress.forgotten; ++n) map.poses_[n] = old_poses[n];
  EXPECT_TRUE(map.content() == map.wanted(random));
}

TEST(MapCorrector, AScanThatCannotMoveStaysAndIsCounted) {
  std::mt19937 random(16);
  Corrected map(withRules());
  Way poses = way(6, 0.5);
  for (const StampedMotion& pose : poses.odometry)
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  poses.moved[2].motion.translation().x() = 1e12;  // outside of any map
  map.correct(poses.moved);
  map.finish();
  const MapCorrector::Progress progress = map.corrector_.progress();
  EXPECT_EQ(progress.failed, 1u);
  EXPECT_NE(progress.fault.find("too far from the map's origin"), std::string::npos) << progress.fault;
  EXPECT_TRUE(progress.done);
  map.poses_[2] = poses.odometry[2].motion;
  EXPECT_TRUE(map.content() == map.wanted(random));
}

TEST(MapCorrector, ALaterPathWins) {
  std::mt19937 random(17);
  Corrected map(withRules());
  Way wrong = way(6, 0.5);
  const Way right = way(6, -0.5);
  for (const StampedMotion& pose : wrong.odometry) {
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  }
  map.finish();
  for (StampedMotion& pose : wrong.moved) pose.motion.translation().x() = 1e12;  // outside of any map
  for (int n = 0; n < 4; ++n) {
    map.correct(wrong.moved);
    map.corrector_.update(Eigen::Vector3d::Zero());
    map.correct(right.moved);
    map.corrector_.update(Eigen::Vector3d::Zero());
  }
  map.finish();
  EXPECT_EQ(map.corrector_.progress().failed, 0u);
  EXPECT_TRUE(map.content() == map.wanted(random));
}

/// What another map has seen stays, also where scans move.
TEST(MapCorrector, ForeignEvidenceAndItsLooksStay) {
  std::mt19937 random(18);
  const Way poses = way(4, 0.5);
  SemanticMapper other(withRules(), reference::tableWithDynamicClass());
  for (const StampedMotion& pose : poses.odometry)
    other.integrate(roomScan(pose.motion, pose.stamp / 2, random));
  Corrected map(withRules());
  map.mapper_.addMap(other.map());
  map.corrector_.noteForeign(other.map().regions());
  for (const StampedMotion& pose : poses.odometry) {
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  }
  map.correct(poses.moved);
  map.finish();
  ASSERT_EQ(map.corrector_.progress().moved, 4u);
  const auto withoutLooks = [](const SemanticMap& content) {
    std::map<GridIndex, std::vector<EvidenceUnits>> planes;
    for (const auto& [index, block] : content.entries()) {
      planes[index].assign(block->plane(0), block->plane(0) + block->classes().size() * kBlockVoxels);
    }
    return planes;
  };
  SemanticMapper wanted(withRules(), reference::tableWithDynamicClass());
  wanted.addMap(other.map());
  for (std::size_t n = 0; n < map.scans_.size(); ++n) wanted.integrate(place(map.scans_[n], map.poses_[n]));
  EXPECT_TRUE(withoutLooks(map.mapper_.map()) == withoutLooks(wanted.map()));
  std::size_t looks = 0;
  for (const auto& [index, block] : other.map().entries()) {
    const Block* const now = map.mapper_.map().find(index);
    ASSERT_NE(now, nullptr);
    looks += !block->looks().empty();
    EXPECT_LE(now->looks().empty(), block->looks().empty());
  }
  EXPECT_GT(looks, 0u);
}

TEST(MapCorrector, AResetDuringAMoveForgetsIt) {
  std::mt19937 random(19);
  Corrected map(withRules());
  const Way poses = way(4, 0.5);
  for (const StampedMotion& pose : poses.odometry) {
    map.add(roomScan(pose.motion, pose.stamp, random), pose.motion, pose.motion);
  }
  map.finish();
  map.correct(poses.moved);
  map.corrector_.update(Eigen::Vector3d::Zero());  // the move has begun
  map.mapper_.reset();
  map.corrector_.reset();
  map.finish();
  EXPECT_EQ(map.mapper_.map().size(), 0u);
  EXPECT_EQ(map.corrector_.progress().scans, 0u);
  EXPECT_TRUE(map.corrector_.progress().done);
}

TEST(MapCorrector, RoundsByTheSizeOfVoxelsUnlessItIsToldHow) {
  const auto quantumFor = [](double resolution, double asked) {
    MapperConfig config;
    config.resolution = resolution;
    MapCorrector::Settings settings;
    settings.quantum = asked;
    const Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    return Corrected(config, settings)
        .corrector_.round(scanFromSensorFrame(pose, {}, {}, 1), pose)
        .scan.quantum;
  };
  EXPECT_DOUBLE_EQ(quantumFor(0.1, 0.0), 0.001);
  EXPECT_DOUBLE_EQ(quantumFor(0.3, 0.0), 0.01);
  EXPECT_DOUBLE_EQ(quantumFor(2.0, 0.0), 0.01);
  EXPECT_DOUBLE_EQ(quantumFor(0.1, 0.02), 0.02);
}

TEST(MapCorrector, SettingsThatDependOnTheOrderAreRefused) {
  MapperConfig config;
  config.occlusion = OcclusionExtent::kAll;
  EXPECT_THROW(Corrected map(config), std::invalid_argument);
  config.occlusion = OcclusionExtent::kNone;
  Corrected map(config);
  config.free_space.extent = FreeSpaceExtent::kMapped;
  EXPECT_THROW(map.corrector_.reconfigure(config), std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
