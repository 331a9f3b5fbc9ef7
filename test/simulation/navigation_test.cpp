// A robot that drives as examples/plan_path.cpp plans on the map of a simulated street hits nothing that
// stands in the street. A robot that maps, looks out for what moves, and plans while it drives hits nothing
// at all. With BKI_MAPPING_DRIVE, the name of a folder, its drive is written there.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <vector>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/settings/yaml.h"
#include "bki_mapping/store/mapper_file.h"
#include "examples/planner.h"
#include "simulation/lidar.h"
#include "simulation/street_parts.h"
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
    DriveRecord record;
    record.id = "simulated";
    const auto mapper = mapped(&record);
    saveMap(mapFile(), mapInfoOf(*mapper, "map"), {record}, mapper->map());
  }
  static std::unique_ptr<SemanticMapper> emptyMapper() {
    MapperConfig settings;
    setParameters(settings, loadParameterFile(kTables + "presets/robot.yaml"));
    return std::make_unique<SemanticMapper>(
        settings,
        std::make_shared<const ClassTable>(loadClassTable(kTables + "classes/semantic_kitti.yaml")));
  }
  /// A mapper that has mapped the drive.
  static std::unique_ptr<SemanticMapper> mapped(DriveRecord* record = nullptr) {
    auto mapper = emptyMapper();
    for (std::size_t i = 0; i < drive_->size(); ++i) {
      const SequenceFrame frame = drive_->frame(i);
      mapper->integrate(frame.scan());
      if (record) record->addScan(frame.stamp, mapper->map().geometry(), mapper->touchedBlocks());
    }
    return mapper;
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

  /// The label of what the robot hits at a pose on the true street. @param time [s]; nullopt: only what
  /// stands counts, because the preset clears what moves, and leaves it to sensors.
  static std::optional<std::uint32_t> hitAt(const Pose& pose, std::optional<double> time = std::nullopt) {
    const Eigen::Isometry3d T_world_map = drive_->T_world_sensor(0);
    const Eigen::Vector3d centre = T_world_map * Eigen::Vector3d(pose.x, pose.y, 0.0);
    Scene near{drive_->scene().ground, {}};
    for (const Shape& shape : drive_->scene().shapes) {
      const bool moves = !shape.velocity.isZero() || !shape.legs.empty();
      const double reach = shape.half.head<2>().norm() + kHalfLength + kHalfWidth;
      if (moves && !time) continue;
      if ((shape.centreAt(time.value_or(0.0)) - centre).head<2>().norm() < reach)
        near.shapes.push_back(shape);
    }
    const double c = std::cos(pose.yaw), s = std::sin(pose.yaw);
    for (double forward = -kHalfLength; forward <= kHalfLength; forward += 0.04) {
      for (double left = -kHalfWidth; left <= kHalfWidth; left += 0.04) {
        Eigen::Vector3d point = T_world_map * Eigen::Vector3d(pose.x + c * forward - s * left,
                                                              pose.y + s * forward + c * left, 0.0);
        for (point.z() = 0.02; point.z() <= 1.1; point.z() += 0.06) {
          if (const auto label = near.labelAt(point, time.value_or(0.0))) return label;
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
  for (int i = 0; i < 14; ++i) {  // some places are taken by what moves
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

/// A robot that maps the street while it drives, with a lidar on a mast, and plans anew when it must.
class DrivingRobot {
 public:
  /// How it knows what moves.
  struct Senses {
    bool movers = false;  ///< plans around what its last scans hit of classes that can move
    bool latest = false;  ///< plans on a map in which the latest looks decide
  };
  DrivingRobot(const Scene& scene, const Eigen::Isometry3d& T_world_map,
               std::unique_ptr<SemanticMapper> mapper, const planner::Pose& start, double time,
               const Senses& senses)
      : scene_(scene),
        T_world_map_(T_world_map),
        mapper_(std::move(mapper)),
        at_(start),
        time_(time),
        senses_(senses) {
    lidar_.columns = 720;
    lidar_.lowest = -1.0;
  }

  const SemanticMapper& mapper() const { return *mapper_; }
  const planner::Pose& at() const { return at_; }
  double time() const { return time_; }

  /// Scans, and decides where to go.
  void look(const planner::Pose& goal) {
    scan();
    const MapSnapshot now = mapper_->snapshot();
    const Eigen::AlignedBox3d area(Eigen::Vector3d(-5.0, -9.0, -2.5), Eigen::Vector3d(45.0, 12.0, 1.0));
    // Who knows where what moves is going asks the map what stands, or each walker would block its way.
    const planner::Street street(now.map, now.rules.withLatest(senses_.latest), mapper_->classes(), area);
    if (isStillGood(street)) return;
    way_.clear();
    try {
      way_ = planner::plan(street, at_, goal, senses_.movers ? &movers_ : nullptr, 2.5, 6000);
      way_.erase(way_.begin());
    } catch (const std::runtime_error&) {  // it waits
    }
  }
  /// Goes on by one pose of its way, or waits as long as that takes.
  void move() {
    if (!way_.empty()) {
      at_ = way_.front();
      way_.erase(way_.begin());
    }
    time_ += planner::kPeriod / planner::kSpeed;
  }

 private:
  void scan() {
    Eigen::Isometry3d T_map_robot = Eigen::Isometry3d::Identity();
    T_map_robot.translation() = Eigen::Vector3d(at_.x(), at_.y(), 0.0);
    T_map_robot.linear() = Eigen::AngleAxisd(at_.z(), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    SequenceFrame frame =
        simulation::scan(scene_, lidar_, T_world_map_ * T_map_robot, time_, 1000 + scans_++);
    frame.T_map_sensor = T_map_robot;
    frame.stamp = Sequence::kFirstStamp + static_cast<std::uint64_t>(std::llround(time_ * 1e9));
    mapper_->integrate(frame.scan());
    std::vector<Eigen::Vector2d> hits;
    for (std::size_t n = 0; n < frame.points.size(); ++n) {
      const auto id = mapper_->classes().classOfRaw(frame.labels[n]);
      if (!id || !mapper_->classes().find(*id)->dynamic) continue;
      hits.emplace_back((T_map_robot * frame.points[n].cast<double>()).head<2>());
    }
    movers_.update(hits, time_);
  }
  bool isStillGood(const planner::Street& street) const {
    double after = 0.0;
    for (const planner::Pose& pose : way_) {
      after += planner::kPeriod / planner::kSpeed;
      if (!street.isDrivable(pose) || (senses_.movers && !movers_.areClearOf(pose, after))) return false;
    }
    return !way_.empty();
  }

  const Scene& scene_;
  const Eigen::Isometry3d T_world_map_;
  std::unique_ptr<SemanticMapper> mapper_;
  planner::Pose at_;
  double time_;
  const Senses senses_;
  LidarConfig lidar_;
  planner::Movers movers_;
  std::vector<planner::Pose> way_;
  std::uint64_t scans_ = 0;
};

struct DrivenPose {
  planner::Pose at;
  double time;
  std::optional<std::uint32_t> hit;
};

/// Writes map, way, and what moved near the robot, for examples/draw_path.py.
void writeDrive(const std::string& folder, const SemanticMapper& mapper, const Drive& drive,
                const std::vector<DrivenPose>& driven) {
  saveMap(folder + "/driven.bkm", mapInfoOf(mapper, "map"), {}, mapper.map());
  std::ofstream path(folder + "/driven.csv"), movers(folder + "/movers.csv");
  path << "x,y,z,yaw,time\n";
  movers << "x,y,half_length,half_width,time\n";
  const Eigen::Isometry3d T_map_world = drive.T_world_sensor(0).inverse();
  for (std::size_t n = 0; n < driven.size(); ++n) {
    const DrivenPose& pose = driven[n];
    path << pose.at.x() << "," << pose.at.y() << ",-1.73," << pose.at.z() << "," << pose.time << "\n";
    if (n % 10 != 0) continue;
    for (const Shape& shape : drive.scene().shapes) {
      if (shape.velocity.isZero() && shape.legs.empty()) continue;
      const Eigen::Vector3d centre = T_map_world * shape.centreAt(pose.time);
      if ((centre.head<2>() - pose.at.head<2>()).norm() > 6.0) continue;
      movers << centre.x() << "," << centre.y() << "," << shape.half.x() << "," << shape.half.y() << ","
             << pose.time << "\n";
    }
  }
}

// It starts on a sidewalk on which people walk, crosses a road with traffic, and ends on the other sidewalk.
TEST_F(Navigation, DrivesThroughTrafficAndHitsNothing) {
  const planner::Pose start(2.0, -5.3, 0.0), goal(30.0, 8.0, 0.0);
  const auto drive = [&](bool sees_movers) {
    std::vector<DrivenPose> driven;
    DrivingRobot robot(drive_->scene(), drive_->T_world_sensor(0), mapped(), start, 6.0,
                       {sees_movers, false});
    while (robot.time() < 120.0 && (robot.at() - goal).head<2>().norm() >= 0.6) {
      robot.look(goal);
      for (int n = 0; n < 3; ++n) {
        robot.move();
        const planner::Pose& at = robot.at();
        driven.push_back({at, robot.time(), hitAt({at.x(), at.y(), 0.0, at.z(), 0.0}, robot.time())});
      }
    }
    const char* const folder = std::getenv("BKI_MAPPING_DRIVE");
    if (folder && sees_movers) writeDrive(folder, robot.mapper(), *drive_, driven);
    return driven;
  };
  const auto hits = [](const std::vector<DrivenPose>& driven) {
    return std::count_if(driven.begin(), driven.end(), [](const DrivenPose& p) { return p.hit.has_value(); });
  };
  const std::vector<DrivenPose> driven = drive(true);
  EXPECT_LT((driven.back().at - goal).head<2>().norm(), 0.6) << "it arrives";
  for (const DrivenPose& pose : driven) {
    ASSERT_FALSE(pose.hit) << "label " << *pose.hit << " at " << pose.at.transpose() << ", " << pose.time
                           << " s";
  }
  EXPECT_GT(hits(drive(false)), 0) << "there is nothing that it must wait for or drive around";
}

// A yard that has been mapped and is empty; then somebody walks into its way, and stands there.
TEST_F(Navigation, BrakesForAPedestrianBecauseOfTheMap) {
  Scene yard;
  for (const double side : {-1.0, 1.0}) {
    yard.shapes.push_back(box(5.0, 9.0 * side, 1.5, 40.0, 0.4, 3.0, kBuilding));
    yard.shapes.push_back(box(5.0 + 18.0 * side, 0.0, 1.5, 0.4, 18.0, 3.0, kBuilding));
  }
  Motion motion;
  motion.velocity = Eigen::Vector3d(0.0, 1.4, 0.0);
  motion.legs = {{24.0, motion.velocity}, {29.0, Eigen::Vector3d::Zero()}};
  addPedestrian(6.5, -24.0 * 1.4, motion, yard.shapes);
  const Shape& pedestrian = yard.shapes.back();
  Eigen::Isometry3d T_world_map = Eigen::Isometry3d::Identity();
  T_world_map.translation().z() = 1.73;
  const planner::Pose goal(14.0, 0.0, 0.0);
  struct Outcome {
    double least = 1e9, end = 0.0;  ///< distance from the pedestrian [m], and from the goal [m]
  };
  const auto drive = [&](const DrivingRobot::Senses& senses) {
    auto mapper = emptyMapper();
    for (int n = 0; n < 40; ++n) {
      Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
      T_map_sensor.translation().x() = -6.0 + 0.5 * n;
      LidarConfig lidar;
      lidar.columns = 720;
      SequenceFrame frame =
          simulation::scan(yard, lidar, T_world_map * T_map_sensor, 0.1 * n, static_cast<std::uint64_t>(n));
      frame.T_map_sensor = T_map_sensor;
      frame.stamp = Sequence::kFirstStamp + 100'000'000 * static_cast<std::uint64_t>(n);
      mapper->integrate(frame.scan());
    }
    DrivingRobot robot(yard, T_world_map, std::move(mapper), planner::Pose(0.0, 0.0, 0.0), 20.0, senses);
    Outcome outcome;
    while (robot.time() < 60.0 && (robot.at() - goal).head<2>().norm() >= 0.6) {
      robot.look(goal);
      for (int n = 0; n < 3; ++n) {
        robot.move();
        const Eigen::Vector3d to = pedestrian.centreAt(robot.time()) - robot.at();
        const Eigen::Vector2d beside =
            (Eigen::Rotation2Dd(-robot.at().z()) * to.head<2>()).cwiseAbs() - planner::kHalf.head<2>();
        outcome.least = std::min(outcome.least, beside.cwiseMax(0.0).norm() - pedestrian.half.x());
      }
    }
    outcome.end = (robot.at() - goal).head<2>().norm();
    return outcome;
  };
  const Outcome with = drive({false, true}), without = drive({false, false});
  EXPECT_GT(with.least, 0.0) << "it hits the pedestrian";
  EXPECT_LT(with.end, 0.6) << "it goes on";
  EXPECT_LE(without.least, 0.0) << "it would not meet the pedestrian anyway";
}

}  // namespace
}  // namespace bki_mapping::simulation
