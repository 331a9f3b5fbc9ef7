// Somebody walks past a robot whose clouds have no labels: what remains in the map, and who is warned of it.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "simulation/lidar.h"

namespace bki_mapping::simulation {
namespace {

const std::string kConfig = std::string(BKI_MAPPING_SOURCE_DIR) + "/config/";
constexpr std::uint32_t kPerson = 254, kBuilding = 50;
constexpr int kScans = 50;
constexpr double kFloorVoxel = 0.31;  ///< height up to which a voxel may hold the floor as well [m]

/// A wall 10 m ahead of the sensor, and a person who walks along it from the right to the left.
Scene walkerBeforeAWall() {
  Shape wall, person;
  wall.centre = {10.0, 0.0, 2.0};
  wall.half = {0.2, 15.0, 2.0};
  wall.label = kBuilding;
  person.type = ShapeType::kCylinder;
  person.centre = {5.0, -3.0, 0.9};
  person.half = {0.25, 0.25, 0.9};
  person.velocity = {0.0, 1.2, 0.0};
  person.label = kPerson;
  return {Ground(), {wall, person}};
}

/// The share of points in occupied voxels of the final map.
struct Kept {
  double person = 0.0, wall = 0.0;
};

/// Maps scans without labels. @param warnings number of sentences that the settings must give.
Kept map(const std::string& preset, std::size_t warnings) {
  MapperConfig config;
  setParameters(config, loadParameterFile(kConfig + "presets/" + preset + ".yaml"));
  SemanticMapper mapper(
      config, std::make_shared<const ClassTable>(loadClassTable(kConfig + "classes/occupancy.yaml")));
  const std::vector<std::string> said = settingWarnings(config, mapper.classes());
  EXPECT_EQ(said.size(), warnings) << preset;
  for (const std::string& sentence : said) {
    EXPECT_NE(sentence.find("set sensor_model/height"), std::string::npos) << sentence;
  }
  const Scene scene = walkerBeforeAWall();
  LidarConfig lidar;
  lidar.columns = 600;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  T_world_sensor.translation().z() = 1.73;
  std::vector<Eigen::Vector3d> person, wall;
  for (int i = 0; i < kScans; ++i) {
    SequenceFrame frame = scan(scene, lidar, T_world_sensor, 0.1 * i, static_cast<std::uint64_t>(i));
    frame.T_map_sensor = T_world_sensor;
    frame.stamp = 1'000'000'000 + 100'000'000 * static_cast<std::uint64_t>(i);
    Scan mapped = frame.scan();
    for (std::size_t p = 0; p < mapped.points.size(); ++p) {
      const Eigen::Vector3d point = mapped.origin + mapped.points[p].cast<double>();
      const bool left = i < kScans - 15 && point.z() > kFloorVoxel;
      if (mapped.labels[p] == kPerson && left) person.push_back(point);
      if (mapped.labels[p] == kBuilding) wall.push_back(point);
    }
    mapped.labels.assign(mapped.points.size(), 0);
    mapper.integrate(mapped);
  }
  const auto occupied = [&](const std::vector<Eigen::Vector3d>& points) {
    std::size_t count = 0;
    for (const Eigen::Vector3d& point : points) {
      count += viewPoint(mapper.map(), mapper.rules(), point).state == VoxelState::kOccupied;
    }
    return static_cast<double>(count) / static_cast<double>(points.size());
  };
  EXPECT_GT(person.size(), 2000u);
  return {occupied(person), occupied(wall)};
}

TEST(WithoutLabels, ThePresetForThemForgetsAWalker) {
  const Kept kept = map("robot", 1);
  EXPECT_EQ(kept.person, 0.0);
  EXPECT_GT(kept.wall, 0.995);
}

TEST(WithoutLabels, OnlyTheHeightOfTheSensorIsAskedFor) {
  const ClassTable occupancy = loadClassTable(kConfig + "classes/occupancy.yaml"),
                   kitti = loadClassTable(kConfig + "classes/semantic_kitti.yaml");
  for (const auto& [preset, asks] :
       {std::pair("robot", true), std::pair("paper_none", false), std::pair("paper_linear", false),
        std::pair("paper_line", false), std::pair("baseline_even", false)}) {
    MapperConfig config;
    setParameters(config, loadParameterFile(kConfig + "presets/" + preset + ".yaml"));
    EXPECT_EQ(settingWarnings(config, occupancy).size(), asks ? 1u : 0u) << preset;
    EXPECT_TRUE(settingWarnings(config, kitti).empty()) << preset;
    config.sensor_model.height = 1.73;
    EXPECT_TRUE(settingWarnings(config, occupancy).empty()) << preset;
  }
}

}  // namespace
}  // namespace bki_mapping::simulation
