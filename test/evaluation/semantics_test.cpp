// IoU, calibration and ranking by variance on maps constructed by hand, and label noise.
#include <gtest/gtest.h>

#include <cmath>

#include "evaluation/semantic_evaluation.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

TEST(Confusion, KnowsIntersectionsAndUnions) {
  Confusion c;
  c.add(1, 1, 6);
  c.add(1, 2, 2);
  c.add(2, 2, 3);
  c.add(2, kFreeClass, 1);
  c.add(2, 3, 4);
  EXPECT_DOUBLE_EQ(c.iou(1), 6.0 / 8.0);
  EXPECT_DOUBLE_EQ(c.iou(2), 3.0 / (3 + 2 + 1 + 4));
  EXPECT_DOUBLE_EQ(c.iou(3), 0.0);
  EXPECT_TRUE(std::isnan(c.iou(4)));
  EXPECT_DOUBLE_EQ(c.meanIou(), (0.75 + 0.3) / 2);  // class 3 is not the true class of any point
  EXPECT_DOUBLE_EQ(c.accuracy(), 9.0 / 16.0);
  EXPECT_EQ(c.points(2), 8u);
  EXPECT_TRUE(std::isnan(Confusion().accuracy()));
  EXPECT_TRUE(std::isnan(Confusion().meanIou()));
}

/// Adds evidence for a class to the voxel of a point. Voxels of 1 m, prior 0.
void add(SemanticMap& map, const Eigen::Vector3d& point, ClassId id, float evidence) {
  EvidenceUnits plane[kBlockVoxels] = {};
  const VoxelIndex voxel = map.geometry().voxelAt(point);
  plane[GridGeometry::offsetInBlock(voxel)] = unitsOf(static_cast<double>(evidence));
  map.getOrAllocate(GridGeometry::blockOf(voxel)).add(id, plane);
}

class Quality : public testing::Test {
 protected:
  Quality() : map_(GridGeometry(1.0), 1e-9, 4), evaluation_(GridGeometry(1.0), {kMoving}) {}

  /// Points in the middle of voxel x with a true and a predicted label (classes times ten).
  void see(int x, std::uint32_t truth, std::uint32_t predicted, int times = 1) {
    Scan scan;
    for (int n = 0; n < times; ++n) {
      scan.points.emplace_back(static_cast<float>(x) + 0.5f, 0.5f, 0.5f);
      scan.labels.push_back(truth);
    }
    evaluation_.add(scan, std::vector<std::uint32_t>(scan.labels.size(), predicted), *classes_);
  }
  void set(int x, ClassId id, float evidence) { add(map_, {x + 0.5, 0.5, 0.5}, id, evidence); }

  static constexpr std::uint32_t kMoving = 20;  ///< the raw label of what moves

  std::shared_ptr<const ClassTable> classes_ = reference::smallTable();
  SemanticMap map_;
  SemanticEvaluation evaluation_;
};

TEST_F(Quality, ComparesWhatMapAndInputTell) {
  see(0, 10, 10, 3);
  see(0, 10, 20);     // the map outvotes the wrong label
  see(1, 20, 20, 2);  // free in the map
  see(2, 0, 0, 5);    // unlabelled: skipped
  see(3, 30, 77, 2);  // predicted label of no class; unknown in the map
  set(0, 1, 1.0f);
  set(1, kFreeClass, 1.0f);
  const SemanticQuality quality = evaluation_.compare(map_, StateRules());
  EXPECT_EQ(quality.map.count(1, 1), 4u);
  EXPECT_EQ(quality.map.count(2, kFreeClass), 2u);
  EXPECT_EQ(quality.map.count(3, kFreeClass), 2u);
  EXPECT_DOUBLE_EQ(quality.map.accuracy(), 0.5);
  EXPECT_EQ(quality.input.count(1, 2), 1u);
  EXPECT_EQ(quality.input.count(3, kFreeClass), 2u);
  EXPECT_DOUBLE_EQ(quality.input.iou(1), 0.75);
  EXPECT_DOUBLE_EQ(quality.input.iou(2), 2.0 / 3.0);
  EXPECT_EQ(quality.map.points(0), 0u);
}

TEST_F(Quality, WhatHasLeftDoesNotCountAsPresent) {
  see(0, 10, 30, 2);            // stands, and is kept
  see(1, 10, 10, 3);            // stands, and is lost
  see(2, kMoving, kMoving, 4);  // has left, and is cleared
  see(3, kMoving, kMoving, 5);  // has left, and is kept
  see(4, kMoving, kMoving, 6);  // is still there
  set(0, 1, 1.0f);
  set(1, kFreeClass, 1.0f);
  set(2, kFreeClass, 1.0f);
  set(3, 2, 1.0f);
  set(4, 2, 1.0f);
  const auto still_there = [](const VoxelIndex& voxel) { return voxel.x == 4; };
  const SemanticQuality quality = evaluation_.compare(map_, StateRules(), still_there),
                        all = evaluation_.compare(map_, StateRules());
  EXPECT_EQ(quality.map.count(2, kFreeClass), 4u) << "all points";
  EXPECT_EQ(quality.input.points(2), 15u);
  EXPECT_EQ(quality.map_of_present.points(1), 5u);
  EXPECT_EQ(quality.map_of_present.count(1, kFreeClass), 3u);
  EXPECT_EQ(quality.map_of_present.points(2), 6u);
  EXPECT_EQ(quality.input_of_present.points(2), 6u);
  EXPECT_EQ(quality.input_of_present.count(1, 3), 2u);
  EXPECT_EQ(quality.map_of_occupied.points(1), 2u);
  EXPECT_EQ(quality.map_of_occupied.count(2, 2), 6u);
  EXPECT_EQ(quality.input_of_occupied.count(1, 3), 2u);
  EXPECT_EQ(quality.input_of_occupied.points(1), 2u);
  EXPECT_EQ(all.map_of_present.points(2), 15u) << "nothing has left";
}

TEST_F(Quality, WrongVoxelsAreOccupiedByAClassThatNoPointHas) {
  see(0, 10, 10);
  see(1, 20, 20);
  see(2, 30, 30);
  set(0, 1, 1.0f);
  set(1, 1, 1.0f);           // wrong
  set(2, kFreeClass, 1.0f);  // free in the map: lost, but not of a wrong class
  const auto wrong = evaluation_.wrongVoxels(map_, StateRules());
  ASSERT_EQ(wrong.size(), 1u);
  EXPECT_EQ(wrong[0].x, 1);
}

TEST_F(Quality, CalibrationComparesProbabilitiesWithWhatIsRight) {
  set(0, 1, 0.8f);
  set(0, 2, 0.2f);
  see(0, 10, 10, 3);
  see(0, 20, 20, 1);  // 3 of 4 are correct at probability 0.8
  set(1, 2, 1.0f);
  see(1, 20, 20, 4);  // all are correct at probability 1
  const SemanticQuality quality = evaluation_.compare(map_, StateRules());
  const auto& bins = quality.probability.bins();
  EXPECT_EQ(bins[8].count + bins[7].count, 4u);  // 0.8 may round either way
  EXPECT_EQ(bins[9].count, 4u);
  EXPECT_NEAR(quality.probability.error(), (std::abs(3 - 3.2) + 0.0) / 8, 1e-5);
  const double share = 0.8 * 0.8 / (0.8 * 0.8 + 0.2 * 0.2);  // of the squares
  EXPECT_EQ(quality.class_probability.bins()[9].count, 8u);
  EXPECT_NEAR(quality.class_probability.error(), (4 * share + 4.0 - 7.0) / 8, 1e-5);
}

TEST_F(Quality, EvidenceForFreeDilutesTheProbabilityAndNotTheClass) {
  set(0, 1, 0.6f);
  set(0, kFreeClass, 0.4f);
  see(0, 10, 10, 4);  // all are correct, at probability 0.6 and class probability 1
  const SemanticQuality quality = evaluation_.compare(map_, StateRules());
  EXPECT_NEAR(quality.probability.error(), 0.4, 1e-5);
  EXPECT_NEAR(quality.class_probability.error(), 0.0, 1e-5);
}

TEST_F(Quality, VarianceThatRanksErrorsHasNoSparsificationError) {
  // Voxel 0: uncertain and wrong. Voxel 1: certain and correct.
  set(0, 1, 0.6f);
  set(0, 2, 0.4f);
  see(0, 20, 20, 4);
  set(1, 1, 50.0f);
  see(1, 10, 10, 4);
  EXPECT_NEAR(evaluation_.compare(map_, StateRules()).sparsification_error, 0.0, 1e-12);
  // Voxel 2: certain and wrong. By variance, voxel 0 is removed first, then 2, 1: error rates 8/12, 4/8, 0/4.
  // By errors, 0 and 2 are removed first, then 1: the same. Voxel 3, uncertain and correct, adds an error.
  set(3, 1, 0.6f);
  set(3, 2, 0.4f);
  see(3, 10, 10, 4);
  set(2, 1, 40.0f);
  see(2, 20, 20, 4);
  // By variance: 0 (or 3) and 3 (or 0), then 2, then 1: error rates 8/16, 4/12, 4/8, 0/4 (or 8/12 second).
  const double best = (8.0 / 16 + 4.0 / 12 + 0 + 0) / 4;
  const double error = evaluation_.compare(map_, StateRules()).sparsification_error;
  EXPECT_GT(error, 0.1);
  EXPECT_LE(error, (8.0 / 16 + 8.0 / 12 + 4.0 / 8 + 0) / 4 - best + 1e-12);
}

}  // namespace
}  // namespace bki_mapping
