/// @file A mapper whose scans move, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "free_space/free_space_model.h"
#include "journal/map_corrector.h"
#include "journal/random_motion.h"
#include "journal/scan_codec.h"
#include "reference/content.h"
#include "reference/scenes.h"

namespace bki_mapping {

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

inline std::vector<std::pair<std::string, MapperConfig>> configs() {
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
inline void expectTheMapOfTheCorrectedPoses(const std::string& name, const MapperConfig& config,
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
    if (random() % 2) map.corrector_.update(Eigen::Vector3d::Zero(), random() % 2);
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

inline MapperConfig withRules(bool looks = true) {
  for (const auto& [name, config] : configs()) {
    if (config.rules.enabled && config.rules.latest == looks) return config;
  }
  return {};
}

/// Adds scans that see 8 m far, 10 m from each other.
/// @return poses for them, moved to the left by a metre.
inline Keyframes addStreet(Corrected& map, std::size_t count, std::mt19937& random) {
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

}  // namespace bki_mapping
