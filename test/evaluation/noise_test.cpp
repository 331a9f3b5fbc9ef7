// Errors of labels and poses are of the kind and the size asked for.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "evaluation/noise.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

/// Two vehicles (10, 11), two kinds of ground (40, 41), and two things that stand (50, 51).
ClassTable streetTable() {
  std::vector<SemanticClass> classes;
  for (const std::uint32_t raw : {0u, 10u, 11u, 40u, 41u, 50u, 51u}) {
    SemanticClass c;
    c.id = static_cast<ClassId>(classes.size());
    c.name = "raw" + std::to_string(raw);
    c.raw = {raw};
    c.unlabelled = raw == 0;
    c.dynamic = raw / 10 == 1;
    c.ground = raw / 10 == 4;
    classes.push_back(c);
  }
  return ClassTable("street", classes);
}

/// `count` points of each label, all at the same place.
Scan scanAt(const Eigen::Vector3f& point, const std::vector<std::uint32_t>& labels, std::size_t count) {
  Scan scan;
  for (const std::uint32_t label : labels) {
    scan.points.insert(scan.points.end(), count, point);
    scan.labels.insert(scan.labels.end(), count, label);
  }
  scan.stamp = 5;
  return scan;
}

double wrongFraction(const Scan& scan, const LabelNoise& noise) {
  const auto noisy = withLabelNoise(scan, streetTable(), noise);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < noisy.size(); ++i) wrong += noisy[i] != scan.labels[i];
  return static_cast<double>(wrong) / static_cast<double>(noisy.size());
}

TEST(LabelNoise, ReplacesTheShareAskedForByOtherClasses) {
  const Scan scan = scanAt(Eigen::Vector3f::Ones(), {20}, 20000);
  const auto classes = reference::smallTable();
  const auto noisy = withLabelNoise(scan, *classes, {0.3, LabelErrors::kEven, 1});
  std::map<std::uint32_t, int> counts;
  for (const std::uint32_t label : noisy) ++counts[label];
  EXPECT_NEAR(counts[20], 14000, 300);
  EXPECT_NEAR(counts[10], 3000, 200);
  EXPECT_NEAR(counts[30], 3000, 200);
  EXPECT_EQ(counts.size(), 3u);  // never the unlabelled class
  EXPECT_EQ(withLabelNoise(scan, *classes, {0.3, LabelErrors::kEven, 1}), noisy);
  EXPECT_NE(withLabelNoise(scan, *classes, {0.3, LabelErrors::kEven, 2}), noisy);
  EXPECT_EQ(withLabelNoise(scan, *classes, {0.0, LabelErrors::kEven, 1}), scan.labels);
}

TEST(LabelNoise, ConfusesSimilarClasses) {
  const Scan scan = scanAt({20.0f, 0.0f, 0.0f}, {10, 11, 40, 41, 50, 51}, 2000);
  for (const LabelErrors errors : {LabelErrors::kSimilar, LabelErrors::kFar, LabelErrors::kObjects}) {
    const auto noisy = withLabelNoise(scan, streetTable(), {0.5, errors, 1});
    for (std::size_t i = 0; i < noisy.size(); ++i) EXPECT_EQ(noisy[i] / 10, scan.labels[i] / 10);
  }
  EXPECT_NEAR(wrongFraction(scan, {0.3, LabelErrors::kSimilar, 1}), 0.3, 0.02);
}

TEST(LabelNoise, ErrsMoreOftenFarAway) {
  const auto wrongAt = [](float distance) {
    return wrongFraction(scanAt({distance, 0.0f, 0.0f}, {10, 40}, 5000), {0.3, LabelErrors::kFar, 1});
  };
  EXPECT_NEAR(wrongAt(20.0f), 0.3, 0.02);
  EXPECT_NEAR(wrongAt(5.0f), 0.075, 0.02);
  EXPECT_EQ(wrongAt(80.0f), 1.0);
}

TEST(LabelNoise, ErrsInWholeObjectsForTheTimeAskedFor) {
  const LabelNoise noise{0.3, LabelErrors::kObjects, 1}, short_lived{0.3, LabelErrors::kObjects, 1, 0.1};
  int wrong = 0, first = 0, second = 0, both = 0;
  for (int n = 0; n < 400; ++n) {
    Scan scan = scanAt({10.0f * static_cast<float>(n) + 1.0f, 0.0f, 0.0f}, {10}, 20);
    const auto noisy = withLabelNoise(scan, streetTable(), noise);
    const bool before = withLabelNoise(scan, streetTable(), short_lived)[0] != 10;
    EXPECT_EQ(std::set<std::uint32_t>(noisy.begin(), noisy.end()).size(), 1u) << n;
    scan.stamp += 100000000;
    EXPECT_EQ(withLabelNoise(scan, streetTable(), noise), noisy) << n;
    const bool after = withLabelNoise(scan, streetTable(), short_lived)[0] != 10;
    wrong += noisy[0] != 10;
    first += before;
    second += after;
    both += before && after;
  }
  EXPECT_NEAR(wrong, 120, 30);
  EXPECT_NEAR(first, 120, 30);
  EXPECT_NEAR(second, 120, 30);
  EXPECT_NEAR(both, 36, 20) << "each tenth of a second anew";
}

TEST(LabelNoise, ErrsAtBordersOnly) {
  Scan scan = scanAt({1.1f, 0.0f, 0.0f}, {10, 50}, 5000);
  EXPECT_NEAR(wrongFraction(scan, {0.3, LabelErrors::kBorders, 1}), 0.3, 0.02);
  for (std::size_t i = 0; i < 5000; ++i) scan.points[i].x() = 3.1f;  // far from the other class
  EXPECT_EQ(wrongFraction(scan, {0.3, LabelErrors::kBorders, 1}), 0.0);
}

TEST(LabelNoise, ErrsAsNetworksDo) {
  const LabelNoise noise{0.4, LabelErrors::kNetwork, 1};
  const auto wrongAt = [&](float distance) {
    double wrong = 0.0;  // over many objects, far from borders
    for (int n = 0; n < 300; ++n) {
      Scan scan = scanAt({0.0f, 0.0f, distance}, {10}, 20);
      scan.origin.x() = 10.0 * n + 1.0;
      scan.stamp = static_cast<std::uint64_t>(n);
      wrong += wrongFraction(scan, noise) / 300;
    }
    return wrong;
  };
  EXPECT_NEAR(wrongAt(0.1f), 0.2, 0.06) << "whole objects";
  EXPECT_NEAR(wrongAt(50.1f), 0.2 + 0.8 * 0.5, 0.06) << "and half of the labels at 50 m";
  double at_border = 0.0;
  for (int n = 0; n < 300; ++n) {
    Scan scan = scanAt({0.1f, 0.0f, 0.0f}, {10, 50}, 20);
    scan.origin.x() = 10.0 * n + 1.0;
    scan.stamp = static_cast<std::uint64_t>(n);
    at_border += wrongFraction(scan, noise) / 300;
  }
  EXPECT_NEAR(at_border, 0.2 + 0.8 * 0.4, 0.06);
}

TEST(LabelNoise, KnowsItsKindsByName) {
  EXPECT_EQ(labelErrorsNamed("far"), LabelErrors::kFar);
  EXPECT_THROW(labelErrorsNamed("near"), std::invalid_argument);
}

/// The errors of 2,000 poses of a straight way of 1 m a step, in the axes of the sensor [m], and the last
/// one.
struct PoseErrors {
  double along = 0.0, about = 0.0;  ///< standard deviations on one axis [m, rad]
  double first = 0.0, last = 0.0;   ///< distances from the true position [m]
};

PoseErrors errorsOf(PoseNoise noise) {
  constexpr int kPoses = 2000;
  PoseErrors errors;
  for (int n = 0; n < kPoses; ++n) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().x() = n;
    const Eigen::Isometry3d error = T.inverse() * noise.next(T);
    errors.along += error.translation().squaredNorm() / (3 * kPoses);
    errors.about += std::pow(Eigen::AngleAxisd(error.linear()).angle(), 2) / (3 * kPoses);
    if (n == 0) errors.first = error.translation().norm();
    errors.last = error.translation().norm();
  }
  errors.along = std::sqrt(errors.along);
  errors.about = std::sqrt(errors.about);
  return errors;
}

TEST(PoseNoise, IsAsLargeAsAskedFor) {
  const PoseErrors errors = errorsOf({PoseNoise::Kind::kWhite, 0.05, 0.01, 1});
  EXPECT_NEAR(errors.along, 0.05, 0.002);
  EXPECT_NEAR(errors.about, 0.01, 0.0004);
  EXPECT_EQ(errorsOf({PoseNoise::Kind::kWhite, 0.0, 0.0, 1}).along, 0.0);
}

TEST(PoseNoise, AddsUpWhereItDrifts) {
  EXPECT_EQ(errorsOf({PoseNoise::Kind::kDrift, 0.05, 0.0, 1}).first, 0.0);
  // A random walk of 1,999 steps: its mean square is 3 * 1,999 * 0.05^2 m^2, so 3.9 m.
  double square = 0.0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    square += std::pow(errorsOf({PoseNoise::Kind::kDrift, 0.05, 0.0, seed}).last, 2) / 20;
  }
  EXPECT_NEAR(std::sqrt(square), 3.9, 1.0);
  EXPECT_LT(errorsOf({PoseNoise::Kind::kDrift, 0.0, 0.0, 1}).last, 1e-9);
}

}  // namespace
}  // namespace bki_mapping
