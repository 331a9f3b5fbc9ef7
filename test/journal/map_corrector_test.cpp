// The law of corrections: the map is, to the bit, that of the scans at their corrected poses.
#include "journal/map_corrector.h"

#include <gtest/gtest.h>

#include <atomic>
#include <random>

#include "free_space/free_space_model.h"
#include "journal/random_motion.h"
#include "journal/scan_codec.h"
#include "reference/content.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

using Keyframes = std::vector<StampedMotion>;

/// A mapper with a corrector, and what the law demands of its map.
class Corrected {
 public:
  /// @param in_file whether a map file has the scans, too.
  explicit Corrected(const MapperConfig& config, MapCorrector::Settings settings = exactSettings(),
                     bool in_file = false)
      : config_(config),
        in_file_(in_file),
        mapper_(config, reference::tableWithDynamicClass()),
        corrector_(config, reference::tableWithDynamicClass(), settings,
                   {[this](SemanticMap difference) {
                      std::vector<GridIndex> changed;
                      for (const auto& [index, block] : difference.entries()) changed.push_back(index);
                      mapper_.addMap(std::move(difference));
                      return changed;
                    },
                    [this](const GridIndex& region, const LooksByBlock& looks) {
                      return mapper_.replaceLooks(region, looks);
                    },
                    {},
                    in_file ? [this](std::uint64_t number) {
                      ++fetched_;
                      return packScan(scans_[number]);
                    } : ScanMover::Fetch()}) {}

  void add(const Scan& scan, const Eigen::Isometry3d& pose, const Eigen::Isometry3d& odometry) {
    const RoundedScan rounded = corrector_.round(scan, pose);
    mapper_.integrate(place(rounded.scan, rounded.T_map_sensor));
    corrector_.addScan(rounded.scan, 0, rounded.T_map_sensor, odometry, mapper_.touchedBlocks());
    if (in_file_) corrector_.noteStored(scans_.size());
    scans_.push_back(rounded.scan);
    poses_.push_back(rounded.T_map_sensor);
    odometry_.push_back({scan.stamp, odometry});
  }
  void correct(const Keyframes& keyframes) {
    corrector_.correct(keyframes, {Eigen::Isometry3d::Identity()});
    std::vector<StampedMotion> odometry = odometry_;
    std::sort(odometry.begin(), odometry.end(),
              [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
    const CorrectedPath path(keyframes, odometry);
    for (std::size_t n = 0; n < scans_.size(); ++n) {
      poses_[n] = path.poseAt(scans_[n].stamp, odometry_[n].motion).value_or(poses_[n]);
    }
  }
  /// What the map is to be: all scans at their corrected poses, in another order.
  std::map<GridIndex, std::string> wanted(std::mt19937& random) const {
    MapperConfig config = config_;
    config.threads = 1 + static_cast<int>(random() % 2);
    SemanticMapper fresh(config, reference::tableWithDynamicClass());
    std::vector<std::size_t> order(scans_.size());
    for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
    std::shuffle(order.begin(), order.end(), random);
    for (const std::size_t n : order) fresh.integrate(place(scans_[n], poses_[n]));
    return reference::contentOf(fresh.map());
  }
  std::map<GridIndex, std::string> content() const { return reference::contentOf(mapper_.map()); }
  void finish() { corrector_.finish(Eigen::Vector3d::Zero()); }

  MapperConfig config_;
  bool in_file_;
  std::atomic<std::size_t> fetched_ = 0;  ///< scans, from the file
  SemanticMapper mapper_;
  MapCorrector corrector_;
  std::vector<SensorScan> scans_;
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<StampedMotion> odometry_;
};

std::vector<std::pair<std::string, MapperConfig>> configs() {
  std::vector<std::pair<std::string, MapperConfig>> configs;
  for (const std::string& mode : freeSpaceModes()) {
    MapperConfig config;
    config.free_space.mode = mode;
    config.free_space.gap = 0.5;
    config.threads = 2;
    configs.emplace_back(mode, config);
  }
  MapperConfig rules;
  rules.free_space.mode = "line";
  rules.rules.enabled = true;
  rules.sensor_model.height = 1.5;
  configs.emplace_back("with rules and looks", rules);
  rules.rules.latest = false;
  configs.emplace_back("with rules, without looks", rules);
  return configs;
}

/// Random scans, paths, and moments at which the corrector may work; scans come late, and out of order.
void expectTheMapOfTheCorrectedPoses(const std::string& name, const MapperConfig& config,
                                     const MapCorrector::Settings& settings = exactSettings()) {
  std::mt19937 random(11);
  Corrected map(config, settings);
  std::uint64_t stamp = 1'000'000'000;
  Eigen::Isometry3d drift = Eigen::Isometry3d::Identity();
  for (int step = 0; step < 40; ++step) {
    if (random() % 8) {
      stamp += 70'000'000 + random() % 300'000'000;
      if (random() % 6 == 0) drift = drift * randomMotion(random, 0.3, 0.05);
      Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
      truth.translation() = Eigen::Vector3d(0.1 * step - 2.0, 0.3 * std::sin(step), 0.0);
      const Eigen::Isometry3d pose = drift * truth;
      const std::uint64_t late = random() % 5 ? stamp : stamp - 60'000'000;
      map.add(roomScan(truth, late, random), pose, pose);
    } else if (!map.scans_.empty()) {
      Keyframes keyframes;
      for (std::size_t n = random() % 3; n < map.scans_.size(); n += 1 + random() % 4) {
        keyframes.push_back({map.scans_[n].stamp, randomMotion(random, 0.5, 0.1) * map.odometry_[n].motion});
      }
      map.correct(keyframes);
    }
    if (random() % 2) map.corrector_.update(Eigen::Vector3d::Zero());
  }
  map.finish();
  const MapCorrector::Progress progress = map.corrector_.progress();
  EXPECT_TRUE(progress.done);
  EXPECT_EQ(progress.failed, 0u) << progress.fault;
  EXPECT_GT(progress.moved, 10u) << name;
  EXPECT_EQ(progress.scans, map.scans_.size());
  EXPECT_TRUE(map.content() == map.wanted(random)) << name;
  EXPECT_EQ(map.mapper_.mapBytes(), map.mapper_.map().bytes());
}

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

MapperConfig withRules(bool looks = true) {
  for (const auto& [name, config] : configs()) {
    if (config.rules.enabled && config.rules.latest == looks) return config;
  }
  return {};
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

TEST(MapCorrector, TheMemoryForLooksChangesNoBit) {
  for (const std::size_t bytes : {0, 1, 200'000}) {
    MapCorrector::Settings settings = exactSettings();
    settings.looks_memory = bytes;
    expectTheMapOfTheCorrectedPoses(std::to_string(bytes) + " bytes for looks", withRules(), settings);
  }
}

/// Adds scans that see 8 m far, 10 m from each other.
/// @return poses for them, moved to the left by a metre.
Keyframes addStreet(Corrected& map, std::size_t count, std::mt19937& random) {
  Keyframes moved;
  for (std::size_t n = 0; n < count; ++n) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation().x() = 10.0 * static_cast<double>(n);
    const std::uint64_t stamp = 1'000'000'000 + 400'000'000 * n;
    Scan scan = roomScan(Eigen::Isometry3d::Identity(), stamp, random);
    scan.origin = pose.translation();
    map.add(scan, pose, pose);
    pose.translation().y() = 1.0;
    moved.push_back({stamp, pose});
  }
  return moved;
}

/// Scans whose looks are not kept are read again, and looked through.
TEST(MapCorrector, WithLessMemoryForLooksMoreScansAreLookedThrough) {
  constexpr std::size_t kScans = 24;
  const auto lookedThrough = [&](std::size_t bytes) {
    MapCorrector::Settings settings = exactSettings();
    settings.memory = 1;
    settings.looks_memory = bytes;
    std::mt19937 random(21);
    Corrected map(withRules(), settings, true);
    const Keyframes moved = addStreet(map, kScans, random);
    map.finish();  // packs
    map.correct(moved);
    map.finish();
    EXPECT_EQ(map.corrector_.progress().moved, kScans);
    EXPECT_TRUE(map.content() == map.wanted(random)) << bytes;
    return map.fetched_.load();
  };
  const std::size_t all = lookedThrough(0), some = lookedThrough(50'000);
  EXPECT_GE(all, 2 * (kScans - 1));  // to be moved, and to be looked through; the last one is in memory
  EXPECT_LT(some, all);
  EXPECT_LT(lookedThrough(MovedLooks::kMostBytes), some);
}

/// Another path comes while scans far from the robot move, or when all have moved and the looks there are
/// made.
TEST(MapCorrector, APathThatComesBeforeFarLooksAreMadeWins) {
  constexpr std::size_t kScans = 16;
  std::size_t while_looking = 0;
  for (const std::size_t bytes : {std::size_t{0}, MovedLooks::kMostBytes}) {
    for (const auto& [moves, updates] : {std::pair(8, 0), {16, 0}, {16, 2}}) {
      MapCorrector::Settings settings = exactSettings();
      settings.looks_memory = bytes;
      std::mt19937 random(22);
      Corrected map(withRules(), settings);
      const Keyframes first = addStreet(map, kScans, random);
      map.finish();  // packs
      map.correct(first);
      const Eigen::Vector3d robot = first.back().motion.translation();
      const auto update = [&] {
        map.corrector_.update(robot);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      };
      while (map.corrector_.progress().moved < static_cast<std::size_t>(moves)) update();
      for (int n = 0; n < updates; ++n) update();
      const MapCorrector::Progress progress = map.corrector_.progress();
      while_looking += progress.to_go == 0 && !progress.done;
      Keyframes second;
      for (std::size_t n = 0; n < first.size(); ++n) {  // some stay
        second.push_back(first[n]);
        if (n % 3 > 0) second.back().motion.translation().y() -= 1.7;
      }
      map.correct(second);
      map.corrector_.finish(robot);
      ASSERT_TRUE(map.corrector_.progress().done);
      ASSERT_TRUE(map.content() == map.wanted(random))
          << bytes << " bytes, after " << moves << " moves and " << updates << " updates";
    }
  }
  EXPECT_GE(while_looking, 2u);
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
