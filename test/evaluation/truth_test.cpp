// Free and occupied voxels, classes and ghosts against the ground truth of a small scene.
#include "evaluation/truth_evaluation.h"

#include <gtest/gtest.h>

#include <fstream>

#include "bki_mapping/settings/yaml.h"
#include "simulation/drive_file.h"
#include "temporary_folder.h"

namespace bki_mapping::simulation {
namespace {

constexpr std::uint32_t kCar = 10, kMovingCar = 252, kRoad = 40, kPole = 80;

/// Voxels of 1 m. The map's origin is 2.5 m above the ground, whose surface is thus inside of the voxels z =
/// -3.
class Truth : public testing::Test {
 protected:
  Truth() {
    Shape parked{ShapeType::kBox, {10.5, 0.5, 0.5}, {0.9, 0.4, 0.5}};
    parked.label = kCar;
    Shape moving = parked;
    moving.label = kMovingCar;
    moving.centre = {20.5, 0.5, 0.5};
    moving.velocity = {10.0, 0.0, 0.0};
    Shape pole{ShapeType::kCylinder, {0.5, 5.5, 1.0}, {0.4, 0.4, 1.0}};
    pole.label = kPole;
    scene_.shapes = {parked, moving, pole};
    T_world_map_.translation().z() = 2.5;
  }

  VoxelTruth truth() const { return {scene_, T_world_map_, GridGeometry(1.0)}; }
  static VoxelIndex voxel(int x, int y, int z) { return {{x, y, z}}; }
  ClassId idOf(const char* name) const {
    for (const SemanticClass& c : classes_.classes()) {
      if (c.name == name) return c.id;
    }
    throw std::invalid_argument(name);
  }
  void add(SemanticMap& map, const VoxelIndex& index, ClassId id) const {
    EvidenceUnits plane[kBlockVoxels] = {};
    plane[GridGeometry::offsetInBlock(index)] = unitsOf(1.0);
    map.getOrAllocate(GridGeometry::blockOf(index)).add(id, plane);
  }
  SemanticMap emptyMap() const {
    return SemanticMap(GridGeometry(1.0), 0.001, static_cast<int>(classes_.classes().size()) + 1);
  }

  Scene scene_;
  Eigen::Isometry3d T_world_map_ = Eigen::Isometry3d::Identity();
  ClassTable classes_ = loadClassTable("semantic_kitti");
};

TEST_F(Truth, LabelsOfVoxels) {
  EXPECT_EQ(truth().contentAt(voxel(3, 0, -3), 0.0).label, kRoad) << "half of it is under the ground";
  EXPECT_FALSE(truth().contentAt(voxel(3, 0, -2), 0.0).label);
  EXPECT_EQ(truth().contentAt(voxel(10, 0, -2), 0.0).label, kCar) << "its roof";
  EXPECT_EQ(truth().contentAt(voxel(20, 0, -2), 0.0).label, kMovingCar);
  EXPECT_FALSE(truth().contentAt(voxel(20, 0, -2), 1.0).label);
  EXPECT_EQ(truth().contentAt(voxel(30, 0, -2), 1.0).label, kMovingCar);
}

TEST_F(Truth, AFreeVoxelIsRightIfItIsMostlyEmpty) {
  EXPECT_DOUBLE_EQ(truth().contentAt(voxel(3, 0, -3), 0.0).filled, 0.5);
  T_world_map_.translation().z() = 2.7;
  EXPECT_NEAR(truth().contentAt(voxel(3, 0, -3), 0.0).filled, 0.3, 1e-12) << "between sample points";
  EXPECT_DOUBLE_EQ(truth().contentAt(voxel(3, 0, -4), 0.0).filled, 1.0);
  EXPECT_DOUBLE_EQ(truth().contentAt(voxel(3, 0, 0), 0.0).filled, 0.0);
  TruthEvaluation evaluation(truth(), classes_);
  SemanticMap map = emptyMap();
  for (const int z : {-4, -3, 0}) add(map, voxel(3, 0, z), kFreeClass);
  const SpaceQuality space = evaluation.compare(map, StateRules(), 0.0).all;
  EXPECT_EQ(space.free_precision.total, 3u);
  EXPECT_EQ(space.free_precision.correct, 2u) << "three tenths of one are in the ground";
  EXPECT_EQ(space.free_empty.correct, 1u);
}

TEST_F(Truth, MarginsGrowShapes) {
  const auto car = [](std::uint32_t label) { return label == kCar; };
  EXPECT_FALSE(truth().isNear(voxel(12, 0, -2), 0.0, 0.0, car));
  EXPECT_TRUE(truth().isNear(voxel(12, 0, -2), 0.0, 1.0, car));
  EXPECT_FALSE(truth().isNear(voxel(1, 5, -2), 0.0, 1.0, car)) << "a pole is no car";
  EXPECT_TRUE(truth().isNearAnything(voxel(1, 5, -2), 0.0, 1.0));
  EXPECT_TRUE(truth().isNearAnything(voxel(3, 0, -2), 0.0, 1.0)) << "the ground";
  EXPECT_FALSE(truth().isNearAnything(voxel(3, 0, -1), 0.0, 1.0));
}

TEST_F(Truth, VoxelsAreComparedOneByOne) {
  TruthEvaluation evaluation(truth(), classes_);
  Scan scan;  // one beam along x at z = -1.5, to the parked car; one hit of the pole
  scan.points = {{9.7f, 0.5f, -1.7f}, {0.2f, 5.2f, -1.9f}};
  scan.origin = {0.0, 0.0, 0.0};
  evaluation.add(scan);
  SemanticMap map = emptyMap();
  add(map, voxel(9, 0, -2), idOf("car"));   // correct
  add(map, voxel(30, 0, -2), idOf("car"));  // the moving car at 1 s: correct, although never hit
  add(map, voxel(20, 0, -2), idOf("car"));  // it was there at 0 s: a ghost
  add(map, voxel(0, 5, -2), idOf("road"));  // a pole: correctly occupied, but of another class
  add(map, voxel(0, 0, -1), kFreeClass);    // crossed, correct
  add(map, voxel(10, 0, -2), kFreeClass);   // the car is there: wrong
  const TruthQuality quality = evaluation.compare(map, StateRules(), 1.0);
  EXPECT_EQ(quality.all.free_precision.total, 2u);
  EXPECT_EQ(quality.all.free_precision.correct, 1u);
  EXPECT_EQ(quality.all.free_empty.correct, 1u);
  EXPECT_EQ(quality.all.occupied_precision.total, 4u);
  EXPECT_EQ(quality.all.occupied_precision.correct, 3u);
  EXPECT_EQ(quality.all.occupied_near.correct, 4u) << "the ground is near the ghost";
  EXPECT_EQ(quality.all.occupied_recall.total, 2u);
  EXPECT_EQ(quality.all.occupied_recall.correct, 2u);
  EXPECT_GT(quality.all.free_recall.total, 5u);
  EXPECT_EQ(quality.all.free_recall.correct, 1u);
  EXPECT_EQ(quality.occupancy.bins()[9].right, 2u) << "the car and the pole";
  EXPECT_EQ(quality.occupancy.bins()[9].count, 2u);
  EXPECT_EQ(quality.occupancy.bins()[0].right, 0u) << "the voxel at the sensor";
  EXPECT_EQ(quality.occupancy.bins()[0].count, 1u);
  EXPECT_EQ(quality.movable, 3u);
  EXPECT_EQ(quality.ghosts, 1u);
  EXPECT_EQ(quality.by_distance[0].occupied_precision.total, 2u) << "up to 10 m";
  EXPECT_EQ(quality.by_distance[1].free_precision.total, 1u) << "at 10.6 m";
  EXPECT_EQ(quality.by_distance[2].occupied_precision.total, 2u) << "20 to 40 m";
  EXPECT_EQ(quality.voxels.count(idOf("pole"), idOf("road")), 1u);
  EXPECT_DOUBLE_EQ(quality.voxels.iou(idOf("car")), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(quality.meanIou(classes_), 1.0 / 3.0) << "of car and pole";
  EXPECT_DOUBLE_EQ(quality.occupiedIou(classes_), 3.0 / 4.0);
}

TEST_F(Truth, AVoxelIsAGhostHalfASecondAfterTheCar) {
  TruthEvaluation evaluation(truth(), classes_);
  SemanticMap map = emptyMap();
  add(map, voxel(20, 0, -2), idOf("car"));  // the rear of the car leaves the adjacent voxel at 0.24 s
  EXPECT_TRUE(evaluation.ghosts(map, StateRules(), 0.3).empty());
  EXPECT_TRUE(evaluation.ghosts(map, StateRules(), 0.6).empty());
  EXPECT_EQ(evaluation.ghosts(map, StateRules(), 0.9).size(), 1u);
  evaluation.countGhosts(map, StateRules(), 0.6);
  evaluation.countGhosts(map, StateRules(), 0.9);
  EXPECT_DOUBLE_EQ(evaluation.compare(map, StateRules(), 0.9).mean_ghosts, 0.5);
}

TEST(DriveFile, GivesTheSameStreetAgain) {
  const TemporaryFolder folder;
  EXPECT_FALSE(readDriveFile(folder / "."));
  DriveConfig config{7, 3.25, 11, LidarConfig()};
  config.lidar.range_noise = 0.1 / 3.0;
  config.height = 1.5;
  writeDriveFile(folder / ".", config);
  const auto read = readDriveFile(folder / ".");
  ASSERT_TRUE(read);
  EXPECT_EQ(Drive(*read).frame(6).points, Drive(config).frame(6).points);
  const double kittis = DriveConfig().height;
  EXPECT_NEAR(Drive(config).T_world_sensor(0).translation().z(), 1.5, 1e-12);
  std::string others, line;
  for (std::ifstream file(folder / "simulation.yaml"); std::getline(file, line);) {
    if (line != "height: 1.5") others += line + "\n";
  }
  std::ofstream(folder / "simulation.yaml") << others;
  EXPECT_EQ(readDriveFile(folder / ".")->height, kittis) << "of an earlier version";
  std::ofstream(folder / "simulation.yaml") << "scans: many\n";
  EXPECT_THROW(readDriveFile(folder / "."), std::runtime_error);
}

}  // namespace
}  // namespace bki_mapping::simulation
