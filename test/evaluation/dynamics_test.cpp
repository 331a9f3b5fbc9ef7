// SA, DA and AA on small drives constructed by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "evaluation/dynamics_evaluation.h"
#include "evaluation/occupied_map.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

Scan scanOf(const std::vector<std::pair<Eigen::Vector3f, std::uint32_t>>& points) {
  Scan scan;
  for (const auto& [point, label] : points) {
    scan.points.push_back(point);
    scan.labels.push_back(label);
  }
  return scan;
}

TEST(DynamicsQuality, CountsPointByPoint) {
  // Label 10 is static, 20 moves, 0 is unlabelled, 99 is in no class. Four scans: two early, one late.
  const auto classes = reference::smallTable();
  DynamicsEvaluation evaluation(GridGeometry(1.0), {20}, 4, 1);
  evaluation.add(scanOf({{{0.5f, 0, 0}, 10}, {{0.6f, 0, 0}, 10}, {{5.5f, 0, 0}, 20}, {{7.5f, 0, 0}, 20}}),
                 *classes);
  EXPECT_TRUE(evaluation.isStillThere({5, 0, 0}));
  EXPECT_FALSE(evaluation.isStillThere({0, 0, 0}));
  evaluation.add(scanOf({{{2.5f, 0, 0}, 10}, {{5.6f, 0, 0}, 20}, {{9.5f, 0, 0}, 20}, {{9.5f, 0, 0}, 0}}),
                 *classes);
  evaluation.add(scanOf({{{11.5f, 0, 0}, 20}, {{3.5f, 0, 0}, 99}, {{NAN, 0, 0}, 10}}), *classes);
  evaluation.add(scanOf({{{9.5f, 0, 0}, 10}}), *classes);
  const SemanticMap map = mapOf({{0.5, 0, 0}, {7.5, 0, 0}, {9.5, 0, 0}});
  std::map<int, VoxelFate> fates;
  for (const auto& [voxel, fate] : evaluation.fates(map, StateRules())) fates[voxel.x] = fate;
  EXPECT_EQ(fates, (std::map<int, VoxelFate>{{0, VoxelFate::kKept},
                                             {2, VoxelFate::kLost},
                                             {5, VoxelFate::kForgotten},
                                             {7, VoxelFate::kLeft},
                                             {9, VoxelFate::kKept}}));
  const DynamicsQuality quality = evaluation.compare(map, StateRules());
  EXPECT_EQ(quality.static_points, 4u);
  EXPECT_EQ(quality.static_kept, 3u);    // two at 0.5, one at 9.5; the voxel of 2.5 is not occupied
  EXPECT_EQ(quality.moving_points, 3u);  // at 5.5, 5.6, 7.5; 9.5 is hit late, 11.5 is not early
  EXPECT_EQ(quality.moving_removed, 2u);
  EXPECT_DOUBLE_EQ(quality.staticAccuracy(), 0.75);
  EXPECT_DOUBLE_EQ(quality.dynamicAccuracy(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(quality.accuracy(), std::sqrt(0.5));
  EXPECT_DOUBLE_EQ(quality.harmonicAccuracy(), 12.0 / 17.0);

  // What the last scan does not see move has left; the last scan sees only something static, in the voxel
  // of 9.5.
  for (const int x : {5, 7, 9, 11, 13}) EXPECT_FALSE(evaluation.isStillThere({x, 0, 0})) << x;
  EXPECT_TRUE(evaluation.hasBeenLeft({7, 0, 0}));
  EXPECT_FALSE(evaluation.hasBeenLeft({9, 0, 0}));

  // A voxel that something is in at the end need not be cleared.
  const auto taken = [](const VoxelIndex& voxel) { return voxel.x == 7; };
  const DynamicsQuality known = evaluation.compare(map, StateRules(), taken);
  EXPECT_EQ(known.moving_points, 2u);
  EXPECT_EQ(known.moving_removed, 2u);
  EXPECT_EQ(known.static_kept, 3u);
  for (const auto& [voxel, fate] : evaluation.fates(map, StateRules(), taken))
    EXPECT_NE(fate, VoxelFate::kLeft) << voxel.x;
  EXPECT_TRUE(evaluation.isStillThere({7, 0, 0}, taken));
  EXPECT_FALSE(evaluation.isStillThere({5, 0, 0}, taken));

  evaluation.add(scanOf({{{7.2f, 0, 0}, 20}}), *classes);
  EXPECT_TRUE(evaluation.isStillThere({7, 0, 0}));
  EXPECT_FALSE(evaluation.isStillThere({5, 0, 0}));
}

TEST(DynamicsQuality, CountsStaticPointsByTheirLabels) {
  // The table has one class for all of them, and the upper 16 bits are an instance.
  SemanticClass anything;
  anything.name = "anything";
  anything.any_raw = true;
  const ClassTable all("all", {anything});
  DynamicsEvaluation evaluation(GridGeometry(1.0), {99}, 1, 1);
  evaluation.add(scanOf({{{0.5f, 0, 0}, 10},
                         {{0.6f, 0, 0}, 10 | (7u << 16)},
                         {{0.7f, 0, 0}, 20},
                         {{1.5f, 0, 0}, 10},
                         {{2.5f, 0, 0}, 30},
                         {{2.5f, 0, 0}, 99}}),
                 all);
  const DynamicsQuality quality = evaluation.compare(mapOf({{0.5, 0, 0}}), StateRules());
  ASSERT_EQ(quality.by_label.size(), 3u);
  EXPECT_EQ(quality.by_label.at(10).points, 3u);
  EXPECT_EQ(quality.by_label.at(10).kept, 2u);
  EXPECT_DOUBLE_EQ(quality.by_label.at(20).accuracy(), 1.0);
  EXPECT_DOUBLE_EQ(quality.by_label.at(30).accuracy(), 0.0);
}

TEST(DynamicsQuality, TellsGroundAndStandingThingsApart) {
  std::vector<SemanticClass> flagged = reference::smallTable()->classes();
  flagged[1].ground = true;
  flagged[2].dynamic = true;
  const ClassTable classes("flags", flagged);
  DynamicsEvaluation evaluation(GridGeometry(1.0), {99}, 1, 1);
  evaluation.add(scanOf({{{0.5f, 0, 0}, 10},
                         {{0.6f, 0, 0}, 10},
                         {{1.5f, 0, 0}, 10},
                         {{2.5f, 0, 0}, 20},
                         {{3.5f, 0, 0}, 20},
                         {{4.5f, 0, 0}, 30}}),
                 classes);
  const DynamicsQuality quality = evaluation.compare(mapOf({{0.5, 0, 0}, {2.5, 0, 0}}), StateRules());
  EXPECT_DOUBLE_EQ(quality.groundAccuracy(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(quality.standingAccuracy(), 0.5);
  EXPECT_DOUBLE_EQ(quality.otherAccuracy(), 0.0);
  EXPECT_DOUBLE_EQ(quality.staticAccuracy(), 0.5);
  EXPECT_EQ(quality.floor_voxels, 2u);
  EXPECT_DOUBLE_EQ(quality.holes(), 0.5);
  EXPECT_DOUBLE_EQ(quality.openHoles(), 0.5);  // that beside it does not help
  for (const double z : {-1.0, 1.0, 2.0}) {
    const DynamicsQuality moved = evaluation.compare(mapOf({{0.5, 0, 0}, {1.5, 0, z}}), StateRules());
    EXPECT_DOUBLE_EQ(moved.holes(), 0.5);
    EXPECT_DOUBLE_EQ(moved.openHoles(), z > 1.0 ? 0.5 : 0.0) << z;
  }
}

TEST(DynamicsQuality, SaysWhatNoMapCanTell) {
  // Label 20 moves, 10 stands. The sensor is at the origin; voxels are 1 m. Things move at 3, 5, 7 and 9 m,
  // in different directions.
  const Eigen::Vector3f shared(3.5f, 0.5f, 0.5f), unseen(0.5f, 5.5f, 0.5f), seen(-6.5f, 0.5f, 0.5f),
      left(0.5f, -8.5f, 0.5f);
  const auto classes = reference::smallTable();
  DynamicsEvaluation evaluation(GridGeometry(1.0), {20}, 6, 1);
  evaluation.add(scanOf({{shared, 20}, {unseen, 20}, {seen, 20}, {left, 20}, {left, 20}}), *classes);
  const auto beyond = [](Eigen::Vector3f point) { return Eigen::Vector3f(2.0f * point); };
  // Beams pass through two of them, and beside one; another ends before it.
  evaluation.add(scanOf({{beyond(seen), 10},
                         {beyond(left), 10},
                         {0.5f * unseen, 10},
                         {beyond(unseen).cwiseProduct(Eigen::Vector3f(3, 1, 5)), 10}}),
                 *classes);
  evaluation.add(scanOf({{shared, 10}}), *classes);
  const SemanticMap map = mapOf({shared.cast<double>(), unseen.cast<double>(), left.cast<double>()});
  DynamicsQuality quality = evaluation.compare(map, StateRules());
  EXPECT_EQ(quality.moving_points, 5u);
  EXPECT_EQ(quality.moving_removed, 1u);
  EXPECT_EQ(quality.moving_shared, 1u);
  EXPECT_EQ(quality.moving_unseen, 1u);
  EXPECT_EQ(quality.decidable_points, 3u);
  EXPECT_EQ(quality.decidable_removed, 1u);
  EXPECT_DOUBLE_EQ(quality.decidableAccuracy(), 1.0 / 3.0);

  // What comes back must be seen to leave again, also after the first half of the scans.
  evaluation.add(scanOf({{left, 20}, {seen, 20}}), *classes);
  evaluation.add(scanOf({{beyond(seen), 10}}), *classes);
  evaluation.add(scanOf({{{20.5f, 20.5f, 0.5f}, 10}}), *classes);
  quality = evaluation.compare(map, StateRules());
  EXPECT_EQ(quality.moving_unseen, 3u);
  EXPECT_EQ(quality.decidable_points, 1u);
  EXPECT_DOUBLE_EQ(quality.decidableAccuracy(), 1.0);
}

TEST(DynamicsQuality, SaysWhatBeamsHaveEnteredAgain) {
  // Of three things that moved, beams later pass through the centres of two and 0.7 m beside the third.
  const Eigen::Vector3f through(5.5f, 0.5f, 0.5f), left(-4.5f, 0.5f, 0.5f), beside(0.5f, 5.5f, 0.5f);
  const Scan moving = scanOf({{through, 20}, {left, 20}, {beside, 20}}),
             later = scanOf(
                 {{2.0f * through, 10}, {2.0f * left, 10}, {2.0f * Eigen::Vector3f(1.2f, 5.5f, 0.5f), 10}});
  const auto classes = reference::smallTable();
  DynamicsEvaluation evaluation(GridGeometry(1.0), {20}, 6, 1);
  const SemanticMap map = mapOf({left.cast<double>(), beside.cast<double>()});
  for (int round = 0; round < 2; ++round) {  // what comes back must be seen to leave again
    evaluation.add(moving, *classes);
    EXPECT_EQ(evaluation.compare(map, StateRules()).entered_points, 0u);
    evaluation.add(later, *classes);
    const DynamicsQuality quality = evaluation.compare(map, StateRules());
    const std::size_t points = round + 1;
    EXPECT_EQ(quality.decidable_points, 3 * points);
    EXPECT_EQ(quality.decidable_removed, points);
    EXPECT_EQ(quality.entered_points, 2 * points);
    EXPECT_EQ(quality.entered_removed, points);
    EXPECT_EQ(quality.enteredAccuracy(), 0.5);
  }
}

TEST(DynamicsQuality, NothingToCountIsNoNumber) {
  const DynamicsEvaluation evaluation(GridGeometry(1.0), {20}, 4, 1);
  const DynamicsQuality quality = evaluation.compare(mapOf({{0, 0, 0}}), StateRules());
  EXPECT_TRUE(std::isnan(quality.staticAccuracy()));
  EXPECT_TRUE(std::isnan(quality.accuracy()));
}

}  // namespace
}  // namespace bki_mapping
