// SA and DA of clouds constructed by hand, as the DynamicMap benchmark counts.
#include "evaluation/cloud_evaluation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "evaluation/occupied_map.h"

namespace bki_mapping {
namespace {

TruthCloud truthOf(const std::vector<std::pair<Eigen::Vector3f, bool>>& points) {
  TruthCloud truth;
  for (const auto& [point, moving] : points) {
    truth.points.push_back(point);
    truth.moving.push_back(moving);
  }
  return truth;
}

TEST(CompareClouds, CountsPointsOfTheTruth) {
  // Static: at 0, 1 and 2 m; moving: at 5, 6 and 7 m, and beside the static one at 2 m.
  const TruthCloud truth = truthOf({{{0, 0, 0}, false},
                                    {{1, 0, 0}, false},
                                    {{2, 0, 0}, false},
                                    {{5, 0, 0}, true},
                                    {{6, 0, 0}, true},
                                    {{7, 0, 0}, true},
                                    {{2, 0.04f, 0}, true}});
  // Kept: 0 exactly, 1 within 5 cm, 2 and so its neighbour, 6; and much that the truth does not have.
  const std::vector<Eigen::Vector3f> cleaned = {{0, 0, 0},     {1, 0.03f, 0.03f}, {2, 0, 0}, {6, 0, 0.02f},
                                                {7, 0.06f, 0}, {20, 0, 0},        {21, 0, 0}};
  const CloudQuality quality = compareClouds(truth, cleaned, 0.05);
  EXPECT_EQ(quality.static_points, 3u);
  EXPECT_EQ(quality.static_kept, 3u);
  EXPECT_EQ(quality.moving_points, 4u);
  EXPECT_EQ(quality.moving_removed, 2u) << "at 5 and 7 m; a neighbour keeps the one at 2 m";
  EXPECT_EQ(quality.cleaned_points, 7u);
  EXPECT_DOUBLE_EQ(quality.staticAccuracy(), 1.0);
  EXPECT_DOUBLE_EQ(quality.dynamicAccuracy(), 0.5);
  EXPECT_DOUBLE_EQ(quality.accuracy(), std::sqrt(0.5));
  EXPECT_DOUBLE_EQ(quality.harmonicAccuracy(), 2.0 / 3.0);
  EXPECT_EQ(compareClouds(truth, cleaned, 0.07).moving_removed, 1u);
  EXPECT_EQ(compareClouds(truth, cleaned, 0.03).static_kept, 2u);
}

TEST(CloudEvaluation, IsTheSameFarFromTheOrigin) {
  const auto evaluate = [](const GridIndex& blocks) {
    const double resolution = 0.3;
    SemanticMap map(GridGeometry(resolution), 0.001f, 2);
    std::vector<EvidenceUnits> plane(kBlockVoxels, 0);
    for (std::size_t v = 0; v < plane.size(); v += 2) plane[v] = 1000;  // every other column of x
    map.getOrAllocate({blocks}).add(0, plane.data());
    Scan scan;
    scan.origin = 8.0 * resolution * Eigen::Vector3d(blocks.x, blocks.y, blocks.z);
    for (int x = 0; x < 8; ++x) {
      for (int n = 0; n < 20; ++n) {
        const float along = 0.01f + 0.014f * static_cast<float>(n);
        scan.points.emplace_back(0.3f * static_cast<float>(x) + along, 1.0f, 1.0f);
        scan.labels.push_back(n % 2 ? 252u : 40u);
      }
    }
    CloudEvaluation evaluation(std::nullopt, 0.005);
    evaluation.add(scan);
    return evaluation.compare(map, StateRules());
  };
  const CloudQuality near = evaluate({0, 0, 0}), far = evaluate({208000, 1666000, 0});
  EXPECT_EQ(near.static_points, 40u + 40u);
  EXPECT_GT(near.static_kept, 20u);
  EXPECT_EQ(far.static_kept, near.static_kept);
  EXPECT_EQ(far.moving_removed, near.moving_removed);
  EXPECT_EQ(far.cleaned_points, near.cleaned_points);
}

TEST(CompareClouds, NothingKeptAndNothingToKeep) {
  const CloudQuality none = compareClouds(truthOf({{{0, 0, 0}, false}, {{1, 0, 0}, true}}), {}, 0.05);
  EXPECT_EQ(none.static_kept, 0u);
  EXPECT_EQ(none.moving_removed, 1u);
  EXPECT_EQ(none.harmonicAccuracy(), 0.0);
  EXPECT_TRUE(std::isnan(compareClouds({}, {{0, 0, 0}}, 0.05).staticAccuracy()));
}

TEST(CompareClouds, IsThatOfAllPairs) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> draw(0.0f, 1.0f);
  TruthCloud truth;
  std::vector<Eigen::Vector3f> cleaned;
  for (int i = 0; i < 3000; ++i) {
    truth.points.emplace_back(draw(random), draw(random), draw(random));
    truth.moving.push_back(i % 3 == 0);
    cleaned.emplace_back(draw(random), draw(random), draw(random));
  }
  std::size_t kept[2] = {};
  for (std::size_t i = 0; i < truth.points.size(); ++i) {
    for (const Eigen::Vector3f& point : cleaned) {
      if ((point - truth.points[i]).norm() > 0.05f) continue;
      ++kept[truth.moving[i]];
      break;
    }
  }
  const CloudQuality quality = compareClouds(truth, cleaned, 0.05);
  EXPECT_EQ(quality.static_kept, kept[0]);
  EXPECT_EQ(quality.moving_removed, 1000 - kept[1]);
  EXPECT_GT(kept[0], 100u);
  EXPECT_LT(kept[0], 1900u);
}

TEST(CloudEvaluation, TakesThePointsInOccupiedVoxels) {
  Scan scan;
  scan.origin = {10.0, 0.0, 0.0};
  scan.points = {{0.5f, 0, 0},  {1.5f, 0, 0}, {2.5f, 0, 0}, {3.5f, 0, 0},
                 {60.0f, 0, 0}, {0, 2.0f, 0}, {0, 5.0f, 0}, {NAN, 0, 0}};
  scan.labels = {40, 40, 252, 252, 40, 0, 0, 40};
  CloudEvaluation evaluation(std::nullopt, 0.05);
  evaluation.add(scan);
  const CloudQuality quality =
      evaluation.compare(mapOf({{10.5, 0, 0}, {13.5, 0, 0}, {70.0, 0, 0}, {10.0, 5.0, 0}}), StateRules());
  EXPECT_EQ(quality.static_points, 3u) << "none beyond 50 m";
  EXPECT_EQ(quality.static_kept, 2u);
  EXPECT_EQ(quality.moving_points, 3u) << "with an unlabelled one at the car itself";
  EXPECT_EQ(quality.moving_removed, 2u);
  EXPECT_EQ(quality.cleaned_points, 4u);
  EXPECT_EQ(quality.not_finite, 1u);
}

TEST(CloudEvaluation, LabelsScansByTheTruth) {
  Scan scan;
  scan.origin = {1.0, 0.0, 0.0};
  scan.points = {{0.01f, 0, 0}, {1.0f, 0, 0}, {2.0f, 0, 0}};
  scan.labels = {0, 0, 0};
  const CloudEvaluation evaluation(truthOf({{{1, 0, 0}, false}, {{3, 0, 0}, true}}), 0.05);
  const Scan known = evaluation.labelled(scan);
  EXPECT_EQ(known.points, (std::vector<Eigen::Vector3f>{{0.01f, 0, 0}, {2.0f, 0, 0}}));
  EXPECT_EQ(known.labels, (std::vector<std::uint32_t>{0, 252}));
}

}  // namespace
}  // namespace bki_mapping
