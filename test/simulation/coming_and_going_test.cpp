// With the preset robot, a map shows within three scans what comes back to a place, and clears within two
// seconds what leaves it: a door of a class that cannot move, a person who sits down, something small and
// fast. Cars that creep leave few traces. What parks where space was free stays when the robot has gone.
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "simulation/lidar.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

const std::string kTables = std::string(BKI_MAPPING_SOURCE_DIR) + "/config/";

/// A place that a lidar of 32 rows maps ten times a second, at first standing; map and world frame are one.
class MappedPlace {
 public:
  explicit MappedPlace(std::vector<Shape> shapes) {
    scene_.shapes = std::move(shapes);
    lidar_ = lidarNamed("hdl32");
    lidar_.columns = 720;
    MapperConfig settings;
    setParameters(settings, loadParameterFile(kTables + "presets/robot.yaml"));
    mapper_ = std::make_unique<SemanticMapper>(
        settings,
        std::make_shared<const ClassTable>(loadClassTable(kTables + "classes/semantic_kitti.yaml")));
  }
  /// From now on the lidar moves [m/s].
  void drive(const Eigen::Vector3d& velocity) { velocity_ = velocity; }
  double time() const { return 0.1 * static_cast<double>(scans_); }
  /// Maps until a time [s]. @return the voxels within a box that were hit meanwhile.
  std::set<VoxelIndex> mapUntil(double time, const Eigen::AlignedBox3d& box = {}) {
    std::set<VoxelIndex> hit;
    while (this->time() < time) {
      Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
      T_world_sensor.translation() = sensor_;
      sensor_ += 0.1 * velocity_;
      SequenceFrame frame = scan(scene_, lidar_, T_world_sensor, this->time(), scans_);
      frame.T_map_sensor = T_world_sensor;
      frame.stamp = Sequence::kFirstStamp + 100'000'000 * scans_;
      mapper_->integrate(frame.scan());
      for (const Eigen::Vector3f& point : frame.points) {
        const Eigen::Vector3d at = T_world_sensor * point.cast<double>();
        if (box.contains(at)) hit.insert(mapper_->map().geometry().voxelAt(at));
      }
      ++scans_;
    }
    return hit;
  }
  /// The share of voxels that the map shows occupied.
  double occupied(const std::set<VoxelIndex>& voxels) const {
    std::size_t count = 0;
    for (const VoxelIndex& voxel : voxels) {
      count += viewWithoutEntropy(mapper_->map(), mapper_->rules(), voxel).state == VoxelState::kOccupied;
    }
    return static_cast<double>(count) / static_cast<double>(voxels.size());
  }

 private:
  Scene scene_;
  LidarConfig lidar_;
  std::unique_ptr<SemanticMapper> mapper_;
  std::uint64_t scans_ = 0;
  Eigen::Vector3d sensor_ = {0.0, 0.0, 1.2}, velocity_ = Eigen::Vector3d::Zero();
};

TEST(ComingAndGoing, ADoorOfAClassThatCannotMoveOpensAndCloses) {
  Shape door = box(6.15, 0.0, 1.05, 0.1, 1.4, 2.1, kBuilding);
  const Eigen::Vector3d slide(0.0, 1.4, 0.0);
  door.legs = {{5.0, Eigen::Vector3d::Zero()}, {6.0, slide}, {11.0, Eigen::Vector3d::Zero()}, {12.0, -slide}};
  MappedPlace place({door, box(6.15, 3.7, 1.2, 0.2, 6.0, 2.4, kBuilding),
                     box(6.15, -3.7, 1.2, 0.2, 6.0, 2.4, kBuilding),
                     box(10.0, 0.0, 1.2, 0.2, 12.0, 2.4, kBuilding)});
  const auto doorway =
      place.mapUntil(5.0, {Eigen::Vector3d(6.0, -0.45, 0.35), Eigen::Vector3d(6.3, 0.45, 1.7)});
  ASSERT_GT(doorway.size(), 8u);
  EXPECT_EQ(place.occupied(doorway), 1.0) << "closed";
  place.mapUntil(8.0);
  EXPECT_EQ(place.occupied(doorway), 0.0) << "open for two seconds";
  place.mapUntil(11.0);
  EXPECT_EQ(place.occupied(doorway), 0.0);
  place.mapUntil(12.3);
  EXPECT_GT(place.occupied(doorway), 0.95) << "closed for three scans";
  place.mapUntil(15.0);
  EXPECT_EQ(place.occupied(doorway), 1.0);
}

TEST(ComingAndGoing, APersonSitsDownOnTheGroundAndGetsUp) {
  std::vector<Shape> shapes = {box(9.0, 0.0, 1.5, 0.2, 12.0, 3.0, kBuilding)};
  Shape person = pillar(4.0, 0.2, 0.28, 1.75, kMovingPerson);
  const Eigen::Vector3d down(0.0, 0.0, -2.0);  // for half a second: onto the ground
  person.legs = {{4.0, Eigen::Vector3d::Zero()}, {4.5, down}, {9.0, Eigen::Vector3d::Zero()}, {9.5, -down}};
  shapes.push_back(person);
  MappedPlace place(shapes);
  const auto column = [](double low, double high) {
    return Eigen::AlignedBox3d(Eigen::Vector3d(3.6, -0.2, low), Eigen::Vector3d(4.4, 0.6, high));
  };
  place.mapUntil(2.0);
  const auto head = place.mapUntil(4.0, column(1.5, 1.8));
  ASSERT_GT(head.size(), 2u);
  EXPECT_EQ(place.occupied(head), 1.0) << "stands";
  const auto trunk = place.mapUntil(6.5, column(0.35, 0.55));
  EXPECT_EQ(place.occupied(head), 0.0) << "has sat for two seconds";
  EXPECT_GT(place.occupied(trunk), 0.95);
  place.mapUntil(9.0);
  EXPECT_EQ(place.occupied(head), 0.0);
  EXPECT_GT(place.occupied(trunk), 0.95) << "still sits";
  place.mapUntil(9.8);
  EXPECT_GT(place.occupied(head), 0.95) << "has stood for three scans";
}

TEST(ComingAndGoing, ACarThatParksWhereSpaceWasLongFreeStaysWhenTheRobotLeaves) {
  Shape car = box(7.0, 2.6, 0.75, 4.2, 1.8, 1.5, kCar);
  car.appears = 20.0;
  MappedPlace place(
      {car, box(9.0, 9.0, 2.0, 40.0, 0.4, 4.0, kBuilding), box(14.0, 0.0, 2.0, 0.4, 20.0, 4.0, kBuilding)});
  place.mapUntil(60.0);
  // Beams graze the car's faces while the robot drives past it, and away from it.
  place.drive({1.5, -0.2, 0.0});
  place.mapUntil(62.0);
  place.drive({-3.0, 0.2, 0.0});
  const auto there = place.mapUntil(63.0, {Eigen::Vector3d(4.9, 1.7, 0.4), Eigen::Vector3d(9.1, 3.5, 1.5)});
  ASSERT_GT(there.size(), 20u);
  EXPECT_EQ(place.occupied(there), 1.0);
  place.mapUntil(75.0);
  EXPECT_GT(place.occupied(there), 0.95);
}

/// The distance of a voxel's centre from a face of it.
constexpr double kHalfVoxel = 0.15;

/// Whether any corner of a voxel, or a point up to `apart` before or behind it along x, is in a shape.
bool meets(const VoxelIndex& voxel, const std::vector<Shape>& shapes, double apart, double time) {
  const Eigen::Vector3d centre = GridGeometry(2.0 * kHalfVoxel).voxelCentre(voxel);
  bool found = false;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d to((corner & 1) != 0 ? kHalfVoxel + apart : -kHalfVoxel - apart,
                             (corner & 2) != 0 ? kHalfVoxel : -kHalfVoxel,
                             (corner & 4) != 0 ? kHalfVoxel : -kHalfVoxel);
    for (const Shape& shape : shapes) found |= shape.contains(centre + to, time);
  }
  return found;
}

TEST(ComingAndGoing, CarsThatCreepInAQueueLeaveFewTracesBehindThem) {
  // If voids ended before all that kernels of hits reach, 0.069 and 0.24 of the voxels would be occupied.
  for (const auto& [speed, most] : {std::pair(1.0, 0.04), std::pair(0.5, 0.16)}) {
    std::vector<Shape> cars, shapes = {box(0.0, 9.0, 2.0, 80.0, 0.4, 4.0, kBuilding)};
    for (double x = -20.0; x < 60.0; x += 9.0) addCar(x, 3.0, Motion::constant(-speed), cars);
    shapes.insert(shapes.end(), cars.begin(), cars.end());
    MappedPlace place(shapes);
    const Eigen::AlignedBox3d lane(Eigen::Vector3d(-12.0, 1.5, 0.35), Eigen::Vector3d(22.0, 4.5, 2.0));
    const auto before = place.mapUntil(5.9, lane);
    const auto now = place.mapUntil(6.0, lane);
    EXPECT_EQ(place.occupied(now), 1.0) << "where they are, at " << speed << " m/s";
    std::set<VoxelIndex> left;
    for (const VoxelIndex& voxel : before) {
      if (!meets(voxel, cars, kHalfVoxel, 5.9)) left.insert(voxel);
    }
    ASSERT_GT(left.size(), 500u);
    EXPECT_LT(place.occupied(left), most) << "where they were, at " << speed << " m/s";
  }
}

TEST(ComingAndGoing, ASmallThingThatIsFastIsInTheMapWhereItIsAndSoonNowhereElse) {
  for (const double speed : {2.0, 5.0, 10.0}) {
    Shape thing = pillar(7.0, -0.5 * speed - 0.3, 0.2, 1.1, kMovingPerson);
    thing.velocity = {0.0, speed, 0.0};
    thing.vanishes = 1.05;
    MappedPlace place({thing, box(12.0, 0.0, 2.0, 0.4, 20.0, 4.0, kBuilding)});
    const Eigen::AlignedBox3d way(Eigen::Vector3d(6.0, -6.0, 0.4), Eigen::Vector3d(8.0, 6.0, 1.5));
    std::set<VoxelIndex> all;
    while (place.time() < 1.0) {
      const auto now = place.mapUntil(place.time() + 0.05, way);
      ASSERT_FALSE(now.empty());
      EXPECT_EQ(place.occupied(now), 1.0) << speed << " m/s, at " << place.time() << " s";
      all.insert(now.begin(), now.end());
    }
    place.mapUntil(1.7);
    EXPECT_EQ(place.occupied(all), 0.0) << speed << " m/s";
  }
}

}  // namespace
}  // namespace bki_mapping::simulation
