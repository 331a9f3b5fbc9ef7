// A map that knows time, through the mapper: what comes is in it at once, what goes is out of it soon, and
// what has come stays in it when nobody looks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "reference/content.h"

namespace bki_mapping {
namespace {

constexpr std::uint64_t kSecond = 1000000000, kDay = 86400 * kSecond, kToday = 20000 * kDay;

enum class InFront { kNothing, kCar };

/// A sensor 1.5 m above the ground looks along x at a wall 8 m away; a car may stand 3.1 m away.
Scan scanOf(InFront what, std::uint64_t stamp) {
  Scan scan;
  scan.stamp = stamp;
  for (double azimuth = -0.5; azimuth < 0.5; azimuth += 0.01) {
    for (double elevation = -0.45; elevation < 0.1; elevation += 0.01) {
      const Eigen::Vector3d direction(1.0, std::tan(azimuth), std::tan(elevation));  // to x = 1
      const Eigen::Vector3d at_car = 3.1 * direction;
      double range = 8.0;
      std::uint32_t label = 50;
      if (1.5 + range * direction.z() < 0.0) {
        range = -1.5 / direction.z();
        label = 40;
      }
      if (what == InFront::kCar && std::abs(at_car.y()) < 0.9 && at_car.z() < -0.1 && at_car.z() > -1.15) {
        range = 3.1;
        label = 252;
      }
      scan.points.push_back((range * direction).cast<float>());
      scan.labels.push_back(label);
    }
  }
  return scan;
}

/// Scans at 10 Hz. @param begin, duration [s].
std::vector<Scan> scansOf(InFront what, double begin, double duration, std::uint64_t day = kToday) {
  std::vector<Scan> scans;
  for (double time = begin; time < begin + duration - 0.01; time += 0.1) {
    scans.push_back(scanOf(what, day + static_cast<std::uint64_t>(1e9 * time)));
  }
  return scans;
}

MapperConfig robot() {
  MapperConfig config;
  setParameters(config, loadParameterFile("robot"));
  config.threads = 2;
  return config;
}

SemanticMapper mapperOf(const MapperConfig& config = robot()) {
  return {config, std::make_shared<const ClassTable>(loadClassTable("semantic_kitti"))};
}

void integrate(SemanticMapper& mapper, const std::vector<Scan>& scans) {
  for (const Scan& scan : scans) mapper.integrate(scan);
}

/// The share of the car's points in occupied voxels.
double shareOfCar(const SemanticMapper& mapper) {
  const Scan scan = scanOf(InFront::kCar, 0);
  std::size_t points = 0, occupied = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.labels[i] != 252) continue;
    ++points;
    occupied +=
        viewPoint(mapper.map(), mapper.rules(), scan.points[i].cast<double>()).state == VoxelState::kOccupied;
  }
  EXPECT_GT(points, 500u);
  return static_cast<double>(occupied) / static_cast<double>(points);
}

TEST(Latest, WhatComesIsInTheMapAtOnce) {
  SemanticMapper mapper = mapperOf();
  integrate(mapper, scansOf(InFront::kNothing, 0.0, 30.0));
  EXPECT_EQ(shareOfCar(mapper), 0.0);
  for (const Scan& scan : scansOf(InFront::kCar, 30.0, 3.0)) {
    mapper.integrate(scan);
    ASSERT_EQ(shareOfCar(mapper), 1.0) << "at " << scan.stamp;
  }
}

TEST(Latest, WhatGoesIsOutOfItWithinASecond) {
  for (const double stays : {0.5, 5.0, 60.0}) {
    SemanticMapper mapper = mapperOf();
    integrate(mapper, scansOf(InFront::kNothing, 0.0, 5.0));
    integrate(mapper, scansOf(InFront::kCar, 5.0, stays));
    integrate(mapper, scansOf(InFront::kNothing, 5.0 + stays, 1.0));
    EXPECT_LE(shareOfCar(mapper), 0.02) << "after " << stays << " s";
  }
}

TEST(Latest, WhatCameStaysInTheMapThatNobodyLooksAt) {
  SemanticMapper mapper = mapperOf();
  integrate(mapper, scansOf(InFront::kNothing, 0.0, 60.0));
  integrate(mapper, scansOf(InFront::kCar, 60.0, 20.0));
  // Scans that see only the wall's edge far beside the car.
  for (Scan scan : scansOf(InFront::kNothing, 80.0, 30.0)) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3f& point : scan.points) {
      if (point.y() < -0.45f * point.x()) points.push_back(point);
    }
    scan.labels.assign(points.size(), 50);
    scan.points = points;
    mapper.integrate(scan);
  }
  EXPECT_EQ(shareOfCar(mapper), 1.0);
}

TEST(Latest, OfMergedDaysTheLastOneCounts) {
  const auto mapOf = [](InFront what, int day) {
    SemanticMapper mapper = mapperOf();
    integrate(mapper, scansOf(what, 0.0, 20.0, kToday + static_cast<std::uint64_t>(day) * kDay));
    return mapper.snapshot().map;
  };
  const SemanticMap monday = mapOf(InFront::kNothing, 0), tuesday = mapOf(InFront::kCar, 1),
                    wednesday = mapOf(InFront::kNothing, 2);
  const auto shareOf = [&](std::vector<const SemanticMap*> days) {
    SemanticMapper sum = mapperOf();
    for (const SemanticMap* day : days) sum.addMap(*day);
    return shareOfCar(sum);
  };
  EXPECT_EQ(shareOf({&monday, &tuesday}), 1.0);
  EXPECT_EQ(shareOf({&tuesday, &monday}), 1.0);
  EXPECT_LE(shareOf({&monday, &tuesday, &wednesday}), 0.02);
  EXPECT_LE(shareOf({&wednesday, &tuesday, &monday}), 0.02);
}

TEST(Latest, NeitherOrderNorThreadsNorMergingChangeABit) {
  std::vector<Scan> scans = scansOf(InFront::kNothing, 0.0, 2.0);
  for (const Scan& scan : scansOf(InFront::kCar, 2.0, 2.0)) scans.push_back(scan);
  for (const Scan& scan : scansOf(InFront::kNothing, 4.0, 1.0)) scans.push_back(scan);
  SemanticMapper forth = mapperOf();
  integrate(forth, scans);
  const auto expected = reference::contentOf(forth.map());
  std::mt19937 random(1);
  for (const int threads : {1, 7}) {
    std::shuffle(scans.begin(), scans.end(), random);
    MapperConfig config = robot();
    config.threads = threads;
    SemanticMapper mapper = mapperOf(config), other = mapperOf(config);
    const auto middle = scans.begin() + 17;
    integrate(mapper, {scans.begin(), middle});
    integrate(other, {middle, scans.end()});
    mapper.addMap(other.map());
    EXPECT_TRUE(reference::contentOf(mapper.map()) == expected);
    for (const auto& [index, block] : forth.map().entries()) {
      ASSERT_TRUE(block->looks() == mapper.map().find(index)->looks());
    }
    EXPECT_EQ(shareOfCar(mapper), shareOfCar(forth));
  }
}

TEST(Latest, LooksSayNothingOnceTheEvidenceIsWithdrawn) {
  SemanticMapper mapper = mapperOf();
  const std::vector<Scan> with = scansOf(InFront::kCar, 0.0, 1.0);
  integrate(mapper, with);
  for (const Scan& scan : with) mapper.withdraw(scan);
  EXPECT_EQ(mapper.map().size(), 0u);
  integrate(mapper, scansOf(InFront::kNothing, 1.0, 1.0));
  integrate(mapper, {with[0]});
  mapper.withdraw(with[0]);
  EXPECT_EQ(shareOfCar(mapper), 0.0);
}

TEST(Latest, WithoutStampsTheSumDecides) {
  SemanticMapper mapper = mapperOf();
  for (Scan scan : scansOf(InFront::kCar, 0.0, 1.0)) {
    scan.stamp = 0;
    mapper.integrate(scan);
  }
  for (const auto& [index, block] : mapper.map().entries()) EXPECT_TRUE(block->looks().empty());
  EXPECT_EQ(shareOfCar(mapper), 1.0);
}

TEST(Latest, IsOffByDefaultAndInThePaperPresets) {
  EXPECT_FALSE(MapperConfig().rules.enabled);
  for (const char* preset : {"paper_line", "paper_linear", "paper_none", "baseline_even"}) {
    EXPECT_EQ(loadParameterFile(preset).count("rules/enabled"), 0u) << preset;
  }
}

}  // namespace
}  // namespace bki_mapping
