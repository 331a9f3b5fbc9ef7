// A robot that drives as examples/plan_path.cpp plans on the map of a simulated street hits nothing of the
// street.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <vector>

#include "bki_mapping/io/class_table_yaml.h"
#include "bki_mapping/io/config_yaml.h"
#include "bki_mapping/io/mapper_file.h"
#include "bki_mapping/mapping/parameters.h"
#include "simulation/lidar.h"
#include "temporary_folder.h"

namespace bki_mapping::simulation {
namespace {

const std::string kTables = std::string(BKI_MAPPING_SOURCE_DIR) + "/config/";

struct Pose {
  double x, y, z, yaw, cost;
};
constexpr double kHalfLength = 0.6, kHalfWidth = 0.4;  ///< of the robot [m]

/// A street that is mapped once, for all tests, and the robot of the example.
class Navigation : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    DriveConfig config;
    config.scans = 60;
    config.lidar.columns = 900;
    drive_ = std::make_unique<Drive>(config);
    folder_ = std::make_unique<TemporaryFolder>();
    MapperConfig settings;
    setParameters(settings, loadParameterFile(kTables + "presets/robot.yaml"));
    SemanticMapper mapper(settings, std::make_shared<const ClassTable>(
                                        loadClassTable(kTables + "classes/semantic_kitti.yaml")));
    DriveRecord record;
    record.id = "simulated";
    for (std::size_t i = 0; i < drive_->size(); ++i) {
      const SequenceFrame frame = drive_->frame(i);
      mapper.integrate(frame.scan());
      record.addScan(frame.stamp, mapper.map().geometry(), mapper.touchedBlocks());
    }
    saveMap(mapFile(), mapInfoOf(mapper, "map"), {record}, mapper.map());
  }
  static void TearDownTestSuite() {
    drive_.reset();
    folder_.reset();
  }
  static std::string mapFile() { return *folder_ / "street.bkm"; }

  /// What the example prints to its outputs. @param words start and goal.
  static std::string say(const std::string& words,
                         const std::string& classes = kTables + "classes/semantic_kitti.yaml") {
    const std::string command =
        std::string(BKI_MAPPING_PLAN_PATH) + " '" + mapFile() + "' '" + classes + "' " + words + " 2>&1";
    std::string text;
    FILE* const pipe = popen(command.c_str(), "r");
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
    pclose(pipe);
    return text;
  }
  static std::vector<Pose> plan(const std::string& words,
                                const std::string& classes = kTables + "classes/semantic_kitti.yaml") {
    return read(say(words, classes));
  }
  static std::vector<Pose> read(const std::string& printed) {
    std::istringstream text(printed);
    std::string line;
    std::getline(text, line);
    EXPECT_EQ(line, "x,y,z,yaw,cost");
    std::vector<Pose> path;
    while (std::getline(text, line)) {
      Pose& pose = path.emplace_back();
      EXPECT_EQ(
          std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf", &pose.x, &pose.y, &pose.z, &pose.yaw, &pose.cost),
          5)
          << line;
    }
    return path;
  }
  /// The class table with other costs of road and sidewalk.
  static std::string tableWith(const std::string& road, const std::string& sidewalk) {
    const std::string path = *folder_ / ("road_" + road + ".yaml");
    std::ifstream original(kTables + "classes/semantic_kitti.yaml");
    std::ofstream table(path);
    for (std::string line; std::getline(original, line);) {
      if (line.find("name: road,") != std::string::npos)
        line.replace(line.rfind('}'), 1, ", cost: " + road + "}");
      const std::size_t cost = line.find("cost: 30");
      if (cost != std::string::npos) line.replace(cost, 8, "cost: " + sidewalk);
      table << line << "\n";
    }
    return path;
  }
  static std::vector<Pose> straight(const Pose& from, const Pose& to) {
    std::vector<Pose> path;
    const double yaw = std::atan2(to.y - from.y, to.x - from.x);
    for (double part = 0.0; part <= 1.0; part += 0.002) {
      path.push_back({from.x + part * (to.x - from.x), from.y + part * (to.y - from.y), from.z, yaw, 0.0});
    }
    return path;
  }

  /// The label of what the robot hits at a pose on the true street. Only what stands counts: the preset
  /// clears what moves, and leaves it to sensors.
  static std::optional<std::uint32_t> hitAt(const Pose& pose) {
    const Eigen::Isometry3d T_world_map = drive_->T_world_sensor(0);
    const Eigen::Vector3d centre = T_world_map * Eigen::Vector3d(pose.x, pose.y, 0.0);
    Scene near{drive_->scene().ground, {}};
    for (const Shape& shape : drive_->scene().shapes) {
      const bool moves = !shape.velocity.isZero() || !shape.legs.empty();
      const double reach = shape.half.head<2>().norm() + kHalfLength + kHalfWidth;
      if (!moves && (shape.centre - centre).head<2>().norm() < reach) near.shapes.push_back(shape);
    }
    const double c = std::cos(pose.yaw), s = std::sin(pose.yaw);
    for (double forward = -kHalfLength; forward <= kHalfLength; forward += 0.04) {
      for (double left = -kHalfWidth; left <= kHalfWidth; left += 0.04) {
        Eigen::Vector3d point = T_world_map * Eigen::Vector3d(pose.x + c * forward - s * left,
                                                              pose.y + s * forward + c * left, 0.0);
        for (point.z() = 0.02; point.z() <= 1.1; point.z() += 0.06) {
          if (const auto label = near.labelAt(point, 0.0)) return label;
        }
      }
    }
    return std::nullopt;
  }
  static std::size_t hitsOf(const std::vector<Pose>& path) {
    std::size_t hits = 0;
    for (const Pose& pose : path) hits += hitAt(pose).has_value();
    return hits;
  }
  /// The fraction of the path on which the true ground has a label.
  static double shareOf(const std::vector<Pose>& path, std::uint32_t label) {
    double share = 0.0;
    for (const Pose& pose : path) {
      const Eigen::Vector3d point = drive_->T_world_sensor(0) * Eigen::Vector3d(pose.x, pose.y, pose.z);
      share += drive_->scene().ground.labelAt(point.x(), point.y()) == label;
    }
    return share / static_cast<double>(path.size());
  }

  static std::unique_ptr<Drive> drive_;
  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<Drive> Navigation::drive_;
std::unique_ptr<TemporaryFolder> Navigation::folder_;

// From one sidewalk to the other, between the parked cars of both sides.
const char* const kAcross = "2 -5.3 0 48 8 0";
constexpr std::uint32_t kRoad = 40, kSidewalk = 48;  // raw labels of SemanticKITTI

TEST_F(Navigation, HitsNothingThatStands) {
  const std::vector<Pose> path = plan(kAcross);
  ASSERT_GT(path.size(), 450u);
  const Pose &first = path.front(), &last = path.back();
  EXPECT_TRUE(first.x == 2.0 && first.y == -5.3 && first.yaw == 0.0);
  EXPECT_LT(std::hypot(last.x - 48.0, last.y - 8.0), 0.5);
  for (const Pose& pose : path) {
    ASSERT_FALSE(hitAt(pose)) << "label " << *hitAt(pose) << " at " << pose.x << ", " << pose.y;
  }
  EXPECT_GT(hitsOf(straight(first, last)), 10u) << "there is nothing to drive around";
}

TEST_F(Navigation, HitsNothingBetweenOtherPlaces) {
  std::mt19937 random(1);
  const auto draw = [&](int least, int most) {
    return std::to_string(std::uniform_int_distribution<int>(least, most)(random));
  };
  int ways = 0, blocked = 0;
  for (int i = 0; i < 8; ++i) {
    const std::string words =
        draw(-5, 15) + " " + draw(-7, 9) + " 0 " + draw(25, 50) + " " + draw(-7, 9) + " 0";
    const std::string text = say(words);
    if (text.rfind("plan_path: the ", 0) == 0) continue;  // no place to stand, or no way
    const std::vector<Pose> path = read(text);
    ASSERT_FALSE(path.empty()) << words;
    EXPECT_EQ(hitsOf(path), 0u) << words;
    blocked += hitsOf(straight(path.front(), path.back())) > 0;
    ++ways;
  }
  EXPECT_GE(ways, 3);
  EXPECT_GE(blocked, 1);
}

TEST_F(Navigation, DrivesArcsOfTheTurningRadius) {
  const std::vector<Pose> path = plan(kAcross);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Pose &a = path[i - 1], &b = path[i];
    ASSERT_NEAR(std::hypot(b.x - a.x, b.y - a.y), 0.1, 1e-3) << i;
    ASSERT_LE(std::abs(b.yaw - a.yaw), 0.1 / 1.5 + 1e-3) << i;
    const double half = 0.5 * (a.yaw + b.yaw);
    ASSERT_NEAR(std::cos(half) * (b.y - a.y), std::sin(half) * (b.x - a.x), 1e-3) << "it slides sideways";
  }
}

TEST_F(Navigation, PrefersWhatCostsLess) {
  const std::string table = tableWith("90", "0");
  const std::vector<Pose> car = plan(kAcross), foot = plan(kAcross, table);
  EXPECT_EQ(hitsOf(foot), 0u);
  EXPECT_GT(shareOf(car, kRoad), 0.7);
  EXPECT_LT(shareOf(foot, kRoad), 0.5);
  EXPECT_GT(shareOf(foot, kSidewalk), 0.5);
  for (const Pose& pose : car) EXPECT_TRUE(pose.cost == 0.0 || pose.cost == 30.0) << pose.cost;
}

TEST_F(Navigation, NeverDrivesOnWhatCosts100) {
  EXPECT_EQ(say(kAcross, tableWith("100", "0")), "plan_path: the map shows no way from start to goal\n");
}

TEST_F(Navigation, RefusesPlacesWhereTheRobotCannotStand) {
  EXPECT_EQ(say("9 -2.5 0 48 8 0"), "plan_path: the robot cannot stand at the start\n") << "in a parked car";
  for (const char* goal : {"48 14 0", "9 -2.5 0", "1e6 0 0", "1e12 0 0", "nan 0 0", "0 inf 0"}) {
    EXPECT_EQ(say(std::string("2 -5.3 0 ") + goal), "plan_path: the robot cannot stand at the goal\n")
        << goal;
  }
  EXPECT_EQ(say("2 -5.3 0"), "plan_path: give a map file, a class table, and X Y YAW of start and goal\n");
}

}  // namespace
}  // namespace bki_mapping::simulation
