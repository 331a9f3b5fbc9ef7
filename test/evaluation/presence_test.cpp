// Present accuracy, and the times to appear and to clear, on drives constructed by hand.
#include "evaluation/presence_evaluation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>

#include "evaluation/occupied_map.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

/// A table with a class that can move, 20 of which the raw label 21 moves.
std::shared_ptr<const ClassTable> movableTable() {
  SemanticClass ground, car;
  ground.id = 1;
  ground.name = "ground";
  ground.raw = {10};
  car.id = 2;
  car.name = "car";
  car.raw = {20, 21};
  car.dynamic = true;
  return std::make_shared<const ClassTable>("test", std::vector<SemanticClass>{ground, car});
}

/// Scans at 10 Hz of a sensor at (0.5, 0.5, 0.5), by the x of its points on a line, and the occupied voxels
/// of the map after each.
class ScriptedDrive {
 public:
  void add(const std::vector<std::pair<double, std::uint32_t>>& points, const std::set<int>& occupied) {
    Scan scan;
    scan.origin = {0.5, 0.5, 0.5};
    scan.stamp = 1000000000 + 100000000 * n_++;
    std::vector<Eigen::Vector3d> voxels;
    for (const int x : occupied) voxels.emplace_back(x + 0.5, 0.5, 0.5);
    for (const auto& [x, label] : points) {
      scan.points.emplace_back(static_cast<float>(x - 0.5), 0.0f, 0.0f);
      scan.labels.push_back(label);
    }
    map_ = mapOf(voxels);
    MapOccupants map(map_, rules_);
    evaluation_.add(scan, *classes_, map);
  }
  void setTruth(PresenceEvaluation::Taken taken) { evaluation_.setTruth(std::move(taken)); }
  PresenceQuality quality() const {
    MapOccupants map(map_, rules_);
    return evaluation_.quality(map);
  }

 private:
  std::shared_ptr<const ClassTable> classes_ = movableTable();
  PresenceEvaluation evaluation_{GridGeometry(1.0), {21}};
  SemanticMap map_ = mapOf({});
  const StateRules rules_;
  std::uint64_t n_ = 0;
};

TEST(Presence, CountsTheScansOwnPoints) {
  ScriptedDrive drive;
  for (std::size_t n = 0; n < PresenceEvaluation::kFirstScans; ++n) drive.add({{5.5, 21}}, {});
  drive.add({{5.5, 21}, {6.5, 20}, {7.5, 10}, {30.5, 21}, {60.5, 21}}, {5, 30});
  const PresenceQuality quality = drive.quality();
  EXPECT_EQ(quality.moving[0].points, 1u) << "up to 20 m";
  EXPECT_EQ(quality.moving[0].present, 1u);
  EXPECT_EQ(quality.moving[1].points, 2u) << "up to 50 m";
  EXPECT_EQ(quality.moving[1].present, 2u);
  EXPECT_EQ(quality.standing[0].points, 1u);
  EXPECT_EQ(quality.standing[0].present, 0u);
  EXPECT_TRUE(std::isnan(ScriptedDrive().quality().moving[0].accuracy()));
}

TEST(Presence, TimesWhatAppearsAndClears) {
  ScriptedDrive drive;
  drive.add({{9.5, 10}}, {9});
  drive.add({{9.5, 10}}, {9});
  drive.add({{5.5, 21}}, {9});
  drive.add({{5.5, 21}}, {9});
  drive.add({{5.5, 21}}, {5, 9});  // 0.2 s after the first hit
  drive.add({{3.5, 10}}, {3, 5});  // hides the voxel
  drive.add({{9.5, 10}}, {5, 9});  // seen again
  drive.add({{9.5, 10}}, {5, 9});
  drive.add({{9.5, 10}}, {5, 9});
  drive.add({{9.5, 10}}, {9});  // 0.3 s later
  const PresenceQuality quality = drive.quality();
  ASSERT_EQ(quality.appear.seconds.size(), 1u);
  EXPECT_NEAR(quality.appear.seconds[0], 0.2, 1e-6);
  EXPECT_EQ(quality.appear.never, 0u);
  ASSERT_EQ(quality.clear.seconds.size(), 1u);
  EXPECT_NEAR(quality.clear.seconds[0], 0.3, 1e-6);
  EXPECT_EQ(quality.clear.never, 0u);
}

TEST(Presence, KnowsWhatNeverAppearsAndNeverClears) {
  ScriptedDrive drive;
  for (int n = 0; n < 2; ++n) drive.add({{9.5, 10}}, {});
  drive.add({{5.5, 21}, {7.5, 21}}, {7});
  for (int n = 0; n < 15; ++n) drive.add({{9.5, 10}}, {7});
  const PresenceQuality quality = drive.quality();
  EXPECT_EQ(quality.appear.count(), 2u);
  EXPECT_EQ(quality.appear.never, 1u);
  EXPECT_EQ(quality.clear.count(), 1u);
  EXPECT_EQ(quality.clear.never, 1u);
  EXPECT_TRUE(std::isinf(quality.clear.quantile(0.5)));
}

TEST(Presence, LeavesOutVoxelsThatSomethingStaticShares) {
  ScriptedDrive drive;
  for (int n = 0; n < 2; ++n) drive.add({{9.5, 10}}, {});
  drive.add({{5.5, 21}, {5.6, 10}}, {5});
  for (int n = 0; n < 15; ++n) drive.add({{9.5, 10}}, {5});
  const PresenceQuality quality = drive.quality();
  EXPECT_EQ(quality.appear.count(), 0u);
  EXPECT_EQ(quality.clear.count(), 0u);
  EXPECT_EQ(quality.moving[0].present, 1u);
}

TEST(Presence, AsksForTheClassOfWhatIsPresent) {
  ScriptedDrive drive;
  for (int n = 0; n < 2; ++n) drive.add({{5.5, 10}}, {});
  // The map's only class is that of the ground, which the scan hits elsewhere.
  drive.add({{5.5, 21}, {6.5, 20}, {9.5, 10}}, {5});
  const PresenceQuality quality = drive.quality();
  EXPECT_EQ(quality.moving[1].present, 1u);
  EXPECT_EQ(quality.moving[1].named, 0u);
  EXPECT_EQ(quality.moving[1].namedShare(), 0.0);
  EXPECT_TRUE(std::isnan(quality.standing[1].namedShare()));
}

TEST(Presence, TakesAnyClassForRightThatTheScanHitInTheVoxel) {
  ScriptedDrive drive;
  for (int n = 0; n < 2; ++n) drive.add({{9.5, 10}}, {});
  drive.add({{5.5, 21}, {5.6, 10}}, {5});  // feet on the ground
  const PresenceQuality quality = drive.quality();
  EXPECT_EQ(quality.moving[1].present, 1u);
  EXPECT_EQ(quality.moving[1].named, 1u);
}

TEST(Presence, AsksAtTheEndForWhatCameAndStayed) {
  for (const bool is_known : {true, false}) {
    ScriptedDrive drive;
    if (is_known) drive.setTruth([](const VoxelIndex& voxel, double) { return voxel.x != 7; });
    for (int n = 0; n < 2; ++n) drive.add({{3.5, 21}, {9.5, 10}}, {3});
    drive.add({{5.5, 21}, {6.5, 21}, {7.5, 21}}, {});
    drive.add({{2.5, 10}}, {2, 3, 5, 7});  // hides them all
    const PresenceQuality quality = drive.quality();
    EXPECT_EQ(quality.stayed, is_known ? 2u : 0u) << "of 5, 6, 7, and 3, which was there from the start";
    EXPECT_EQ(quality.stayed_present, is_known ? 1u : 0u);
  }
}

TEST(Presence, DoesNotWaitUntilSomethingIsClearedThatIsStillThere) {
  ScriptedDrive drive;
  double gone = 1e9;  // [s]
  drive.setTruth([&](const VoxelIndex&, double time) { return time < gone; });
  for (int n = 0; n < 2; ++n) drive.add({{9.5, 10}}, {});
  drive.add({{5.5, 21}}, {5});
  for (int n = 0; n < 15; ++n) drive.add({{9.5, 10}}, {5});
  EXPECT_EQ(drive.quality().clear.count(), 0u);
  gone = 2.85;  // scans come each tenth of a second, this was the one of 2.7 s
  for (int n = 0; n < 3; ++n) drive.add({{9.5, 10}}, {5});
  drive.add({{9.5, 10}}, {});
  const PresenceQuality quality = drive.quality();
  ASSERT_EQ(quality.clear.seconds.size(), 1u);
  EXPECT_NEAR(quality.clear.seconds[0], 0.2, 1e-6);
}

TEST(Presence, WaitsAnewIfSomethingComesBack) {
  ScriptedDrive drive;
  bool is_taken = true;
  drive.setTruth([&](const VoxelIndex&, double) { return is_taken; });
  for (int n = 0; n < 2; ++n) drive.add({{9.5, 10}}, {});
  drive.add({{5.5, 21}}, {5});
  is_taken = false;
  drive.add({{9.5, 10}}, {5});
  is_taken = true;  // comes back, and no beam hits it
  for (int n = 0; n < 15; ++n) drive.add({{9.5, 10}}, {5});
  EXPECT_EQ(drive.quality().clear.count(), 0u);
  is_taken = false;
  drive.add({{9.5, 10}}, {5});
  drive.add({{9.5, 10}}, {});
  ASSERT_EQ(drive.quality().clear.seconds.size(), 1u);
  EXPECT_NEAR(drive.quality().clear.seconds[0], 0.1, 1e-6);
}

TEST(Presence, DoesNotPraiseWhatWasClearedTooEarly) {
  ScriptedDrive drive;
  bool is_taken = true;
  drive.setTruth([&](const VoxelIndex&, double) { return is_taken; });
  for (int n = 0; n < 2; ++n) drive.add({{9.5, 10}}, {});
  drive.add({{5.5, 21}}, {5});
  drive.add({{9.5, 10}}, {});
  is_taken = false;
  drive.add({{9.5, 10}}, {});
  EXPECT_EQ(drive.quality().clear.count(), 0u);
}

TEST(Delays, HaveQuantiles) {
  Delays delays{{0.3, 0.1, 0.2}, 1};
  EXPECT_EQ(delays.quantile(0.25), 0.1);
  EXPECT_EQ(delays.quantile(0.5), 0.2);
  EXPECT_EQ(delays.quantile(0.75), 0.3);
  EXPECT_TRUE(std::isinf(delays.quantile(0.95)));
  EXPECT_TRUE(std::isnan(Delays().quantile(0.5)));
}

}  // namespace
}  // namespace bki_mapping
