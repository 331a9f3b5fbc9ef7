// Beams without a return: their directions are right within one spacing of beams, or not used.
#include "ros/no_returns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "ros/cloud_conversion.h"
#include "spinning_lidar.h"

namespace bki_mapping::ros_interface {
namespace {

Eigen::Matrix3f turned(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * M_PI / 180.0, axis.normalized()).toRotationMatrix().cast<float>();
}

const std::map<std::string, SpinningLidar>& layouts() {
  static const std::map<std::string, SpinningLidar> all = [] {
    std::map<std::string, SpinningLidar> lidars;
    const Eigen::Matrix3f tilt = turned(30.0, {1, 2, 0}), down = turned(180.0, {1, 0, 0});
    lidars["rows are rings"] = {};
    lidars["rows are firings, as of velodyne_pointcloud"].firings_are_rows = true;
    SpinningLidar ouster;  // staggered: four offsets in turns; beams start beside the axis
    ouster.rings = 64;
    ouster.firings = 1024;
    ouster.stagger = [](std::size_t ring) { return 0.055 - 0.036 * static_cast<double>(ring % 4); };
    ouster.radius = 0.0158;
    lidars["staggered, as of ouster_ros"] = ouster;
    ouster.height = 0.038;
    lidars["staggered, in Ouster's frame os_sensor"] = ouster;
    SpinningLidar
        hesai;  // elevations of a Pandar40P, unevenly spaced; firings spread out while the head turns
    hesai.rings = 40;
    hesai.firings = 1800;
    hesai.elevation = [](double share) {
      const double dense = 0.05 - 0.17 * share;
      return share < 0.2 ? dense + (0.2 - share) : share > 0.8 ? dense - (share - 0.8) : dense;
    };
    hesai.stagger = [](std::size_t ring) {
      return 2e-4 * static_cast<double>(ring) + (ring % 2 ? 0.018 : 0.0);
    };
    hesai.firings_are_rows = true;
    lidars["firings that take time"] = hesai;
    SpinningLidar interleaved;  // the order of lasers in an HDL-32
    interleaved.elevation = [](double share) {
      const int ring = static_cast<int>(std::lround(31.0 * share));
      return 0.0232 * static_cast<double>(ring % 2 ? 16 + ring / 2 : ring / 2) - 0.535;
    };
    lidars["rings in the order of firing"] = interleaved;
    for (const bool rows : {false, true}) {
      const std::string also = rows ? ", rows are firings" : "";
      SpinningLidar lidar;
      lidar.firings_are_rows = rows;
      lidar.stagger = ouster.stagger;
      lidars["every other beam lost" + also] = lidar;
      lidars["every other beam lost" + also].lost = 0.5;
      lidars["90 % lost" + also] = lidar;
      lidars["90 % lost" + also].lost = 0.9;
      lidars["short range" + also] = lidar;
      lidars["short range" + also].max_range = 5.0f;
      lidars["tilted" + also] = lidar;
      lidars["tilted" + also].mount = tilt;
      lidars["tilted, in a level frame" + also] = lidar;
      lidars["tilted, in a level frame" + also].mount = tilt;
      lidars["tilted, in a level frame" + also].frame = down.transpose();
      lidars["in a tilted frame" + also] = lidar;
      lidars["in a tilted frame" + also].frame = tilt;
      lidars["upside down" + also] = lidar;
      lidars["upside down" + also].mount = lidars["upside down" + also].frame = down;
      lidars["a sector" + also] = lidar;
      lidars["a sector" + also].turn = 2.0;
      lidars["a sector" + also].firings = 256;
      lidars["a sector" + also].start = -1.0;
    }
    SpinningLidar large;
    large.rings = 128;
    large.firings = 2048;
    large.stagger = ouster.stagger;
    lidars["128 x 2048"] = large;
    return lidars;
  }();
  return all;
}

/// The angle between two directions [rad].
double angle(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::atan2(a.cast<double>().cross(b.cast<double>()).norm(), a.cast<double>().dot(b.cast<double>()));
}

/// Holes whose row and column have at least three returns.
std::size_t pinnedHoles(const OrganisedCloud& cloud) {
  std::vector<int> rows(cloud.points.size() / cloud.width), columns(cloud.width);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.points[i].hasNaN()) continue;
    ++rows[i / cloud.width];
    ++columns[i % cloud.width];
  }
  std::size_t count = 0;
  for (const std::size_t i : cloud.holes()) {
    count += rows[i / cloud.width] >= 3 && columns[i % cloud.width] >= 3;
  }
  return count;
}

struct Answers {
  std::size_t used = 0;
  double worst = 0.0;  ///< greatest error of a direction used [rad]
  std::optional<NoDirection> unknown;
};

/// Compares the directions of holes with the truth.
Answers answers(const OrganisedCloud& cloud, const Eigen::Vector3f& sensor = Eigen::Vector3f::Zero()) {
  const std::vector<std::size_t> holes = cloud.holes();
  std::vector<Answer> said;
  for (const Eigen::Vector3f& point : cloud.points) {
    said.push_back(answerOf(point.cast<double>(), sensor.cast<double>()));
  }
  const Holes found = directionsOfHoles(cloud.points, said, cloud.width, sensor);
  EXPECT_EQ(found.directions.size(), holes.size());
  EXPECT_EQ(found.same_firing.size(), holes.size());
  Answers result;
  result.unknown = found.unknown;
  for (std::size_t i = 0; i < holes.size(); ++i) {
    if (found.directions[i].isZero(0.0f)) continue;
    ++result.used;
    EXPECT_FALSE(cloud.points[found.same_firing[i]].hasNaN());
    result.worst = std::max(result.worst, angle(found.directions[i], cloud.truth[holes[i]]));
  }
  EXPECT_EQ(found.unknown.has_value(), result.used < holes.size());
  return result;
}

TEST(Directions, OfHolesAreRightInEveryLayout) {
  for (const auto& [name, lidar] : layouts()) {
    SCOPED_TRACE(name);
    const OrganisedCloud cloud = sweep(lidar, BoxScene::street());
    const Answers found = answers(cloud);
    EXPECT_LT(found.worst, lidar.spacing());
    EXPECT_GT(found.used, 1000u);
    EXPECT_GE(found.used, pinnedHoles(cloud) * 95 / 100);
  }
}

TEST(Directions, DoNotDependOnAFewCorruptPoints) {
  for (const bool firings_are_rows : {false, true}) {
    SpinningLidar lidar;
    lidar.firings_are_rows = firings_are_rows;
    OrganisedCloud cloud = sweep(lidar, BoxScene::street());
    std::mt19937 random(1);
    std::uniform_real_distribution<float> anywhere(-9.0f, 9.0f);
    for (std::size_t i = 0; i < cloud.points.size(); i += 331) {
      if (!cloud.points[i].hasNaN()) cloud.points[i] = {anywhere(random), anywhere(random), anywhere(random)};
    }
    const Answers found = answers(cloud);
    EXPECT_LT(found.worst, lidar.spacing());
    EXPECT_GE(found.used, pinnedHoles(cloud) / 2);
  }
}

TEST(Directions, AreThoseOfTheSensorFrameWhereTheCloudsDiffers) {
  SpinningLidar lidar;
  OrganisedCloud cloud = sweep(lidar, BoxScene::street());
  const Eigen::Vector3f mount(1.2f, -0.3f, 1.7f);
  for (Eigen::Vector3f& point : cloud.points) point += mount;
  const Answers wrong = answers(cloud);
  EXPECT_EQ(wrong.used, 0u);
  EXPECT_EQ(wrong.unknown, NoDirection::kNoRings);
  const Answers right = answers(cloud, mount);
  EXPECT_LT(right.worst, lidar.spacing());
  EXPECT_EQ(right.used, cloud.holes().size());
  // Straight above the origin, too, where the rings fit as well.
  cloud = sweep(lidar, BoxScene::street());
  for (Eigen::Vector3f& point : cloud.points) point.z() += 1.7f;
  EXPECT_EQ(answers(cloud).used, 0u);
}

/// A cloud that is the sweep of a lidar but for a change of each point, given its row and column.
OrganisedCloud changed(const std::function<void(std::size_t, std::size_t, Eigen::Vector3f&)>& change,
                       const SpinningLidar& lidar = {}) {
  OrganisedCloud cloud = sweep(lidar, BoxScene::street());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    change(i / cloud.width, i % cloud.width, cloud.points[i]);
  }
  return cloud;
}

TEST(Directions, AreNotUsedWhereTheReturnsDoNotTell) {
  const Eigen::Vector3f none = Eigen::Vector3f::Constant(NAN);
  std::map<std::string, std::pair<OrganisedCloud, NoDirection>> clouds;
  for (const bool firings_are_rows : {false, true}) {
    const std::string also = firings_are_rows ? ", rows are firings" : "";
    SpinningLidar lidar;
    lidar.firings_are_rows = firings_are_rows;
    const auto only = [&](const std::function<bool(std::size_t, std::size_t)>& keep) {
      return changed(
          [&](std::size_t row, std::size_t column, Eigen::Vector3f& p) { p = keep(row, column) ? p : none; },
          lidar);
    };
    using N = NoDirection;
    const std::size_t last = firings_are_rows ? 100 : 31;
    clouds["one row" + also] = {only([=](auto row, auto) { return row == last; }), N::kFewReturns};
    clouds["one column" + also] = {only([](auto, auto column) { return column == 30; }), N::kFewReturns};
    clouds["ten returns" + also] = {only([](auto row, auto column) { return row + column == 40; }),
                                    N::kFewReturns};
    clouds["no returns" + also] = {only([](auto, auto) { return false; }), N::kFewReturns};
  }
  std::mt19937 random(1);
  std::uniform_real_distribution<float> anywhere(-9.0f, 9.0f);
  clouds["points anywhere"] = {changed([&](std::size_t, std::size_t, Eigen::Vector3f& p) {
                                 if (!p.hasNaN()) p = {anywhere(random), anywhere(random), anywhere(random)};
                               }),
                               NoDirection::kNoRings};
  clouds["turned while it was corrected for motion"] = {
      changed([&](std::size_t, std::size_t column, Eigen::Vector3f& p) {
        p = turned(0.02 * static_cast<double>(column), {1, 1, 0}) * p;
      }),
      NoDirection::kNoRings};
  clouds["a depth camera"] = {changed([&](std::size_t row, std::size_t column, Eigen::Vector3f& p) {
                                const float x = 0.002f * (static_cast<float>(column) - 256.0f),
                                            y = 0.03f * (static_cast<float>(row) - 16.0f);
                                if (!p.hasNaN()) p = 5.0f * Eigen::Vector3f(x, y, 1.0f);
                              }),
                              NoDirection::kNoRings};
  for (const auto& [name, cloud] : clouds) {
    SCOPED_TRACE(name);
    const Answers found = answers(cloud.first);
    EXPECT_EQ(found.used, 0u);
    EXPECT_EQ(found.unknown, cloud.second);
  }
  EXPECT_TRUE(directionsOfHoles({}, {}, 0, {0, 0, 0}).directions.empty());
}

const ClassTable& table() {
  static const ClassTable classes = loadClassTable("semantic_kitti");
  return classes;
}

/// The content of an organised cloud of cars, with some other value for points without a return.
CloudContent contentOf(const OrganisedCloud& sweep,
                       const std::function<Eigen::Vector3f(const Eigen::Vector3f&)>& none,
                       bool organised = true) {
  std::vector<Eigen::Vector3f> points = sweep.points;
  for (const std::size_t i : sweep.holes()) points[i] = none(sweep.truth[i]);
  sensor_msgs::PointCloud2 cloud =
      makeCloud(points, std::vector<float>(points.size()), std::vector<std::uint32_t>(points.size(), 10));
  if (organised) {
    cloud.width = static_cast<std::uint32_t>(sweep.width);
    cloud.height = static_cast<std::uint32_t>(points.size() / sweep.width);
    cloud.row_step = cloud.width * cloud.point_step;
  }
  InputConfig input;
  input.clear_no_returns = true;
  return readCloud(cloud, input, table(), LabelValues::kRaw);
}

/// What drivers and simulators write for a beam without a return, given its direction.
const std::map<std::string, std::function<Eigen::Vector3f(const Eigen::Vector3f&)>>& nothings() {
  static const std::map<std::string, std::function<Eigen::Vector3f(const Eigen::Vector3f&)>> all = {
      {"NaN", [](const auto&) { return Eigen::Vector3f::Constant(NAN); }},
      {"0, 0, 0", [](const auto&) { return Eigen::Vector3f::Zero(); }},
      {"infinity times the direction", [](const auto& way) { return Eigen::Vector3f(way * INFINITY); }},
      {"infinity in x and y", [](const auto&) { return Eigen::Vector3f(INFINITY, -INFINITY, 1.0f); }},
      {"infinity and NaN", [](const auto&) { return Eigen::Vector3f(NAN, INFINITY, 1.0f); }},
  };
  return all;
}

TEST(NoReturns, AreHolesHoweverTheyAreWritten) {
  const OrganisedCloud cloud = sweep({}, BoxScene::street());
  const std::size_t holes = cloud.holes().size();
  const CloudContent expected = contentOf(cloud, nothings().at("NaN"));
  for (const auto& [name, none] : nothings()) {
    SCOPED_TRACE(name);
    const CloudContent content = contentOf(cloud, none);
    EXPECT_EQ(content.points.size(), cloud.points.size() - holes);
    EXPECT_EQ(content.no_returns, expected.no_returns);
    EXPECT_FALSE(content.no_direction);
    // Without rows they say nothing, and are counted.
    const CloudContent row = contentOf(cloud, none, false);
    EXPECT_EQ(row.points.size(), content.points.size());
    EXPECT_EQ(row.no_returns, std::vector<Eigen::Vector3f>(holes, Eigen::Vector3f::Zero()));
    EXPECT_EQ(row.no_direction, NoDirection::kUnorganised);
  }
}

TEST(NoReturns, OneInfiniteCoordinateIsADirection) {
  EXPECT_EQ(answerOf({INFINITY, 0, 0}, {0, 0, 0}), Answer::kDirection);
  EXPECT_EQ(directionOf({INFINITY, 0, 0}), Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(answerOf({2, 3, -INFINITY}, {0, 0, 0}), Answer::kDirection);
  EXPECT_EQ(directionOf({2, 3, -INFINITY}), Eigen::Vector3f(0, 0, -1));
  EXPECT_EQ(answerOf({1, 2, 3}, {0, 0, 0}), Answer::kReturn);
  EXPECT_EQ(answerOf({1, 2, 3}, {1, 2, 3.0005}), Answer::kNothing);  // zeros, moved to another frame
  EXPECT_EQ(answerOf({0, 0, 0}, {1, 2, 3}), Answer::kNothing);
  const CloudContent content = contentOf(
      {2, {{1, 2, 3}, {NAN, 0, 0}}, {{1, 0, 0}, {1, 0, 0}}},
      [](const auto&) { return Eigen::Vector3f(0, -INFINITY, 0); }, false);
  EXPECT_EQ(content.no_returns, (std::vector<Eigen::Vector3f>{{0, -1, 0}}));
  EXPECT_FALSE(content.no_direction);
}

/// The free voxels after one scan: all, and those that something hides from the sensor or that are in it, 0.4
/// m or more from its surface: voxels and kernels reach over edges.
std::pair<std::size_t, std::size_t> freeVoxels(const Scan& scan, float max_range) {
  constexpr float kMargin = 0.4f;
  BoxScene solid = BoxScene::street();
  for (auto& box : solid.boxes) box = {box.min().array() + kMargin, box.max().array() - kMargin};
  MapperConfig config;
  config.free_space.mode = "line";
  config.sensor_model.max_range = static_cast<double>(max_range);
  SemanticMapper mapper(config, std::make_shared<const ClassTable>(table()));
  const PointCounts counts = mapper.integrate(scan).counts;
  EXPECT_EQ(counts.points, scan.points.size() + scan.no_returns.size());
  EXPECT_EQ(counts.no_returns + counts.no_direction, scan.no_returns.size());
  std::size_t all = 0, hidden = 0;
  forEachKnownVoxel(mapper.map(), mapper.rules(), [&](const VoxelIndex& voxel, const VoxelView& view) {
    if (view.state != VoxelState::kFree) return;
    const Eigen::Vector3f centre = mapper.map().geometry().voxelCentre(voxel).cast<float>();
    const float range = centre.norm();
    ++all;
    hidden += solid.distance({0, 0, 0}, centre / range) < range - kMargin;
  });
  return {all, hidden};
}

TEST(NoReturns, FreeNothingInAShadowOrBelowTheGround) {
  for (const auto& [name, lidar] : layouts()) {
    if (lidar.lost > 0.0 || lidar.rings > 64)
      continue;  // a beam that a person swallows does clear the person
    SCOPED_TRACE(name);
    const CloudContent content = contentOf(sweep(lidar, BoxScene::street()), nothings().at("NaN"));
    const Eigen::Matrix3f to_scene = lidar.frame.transpose();
    Scan scan;
    for (const auto& point : content.points) scan.points.push_back(to_scene * point);
    scan.labels.assign(scan.points.size(), 10);
    const std::size_t without = freeVoxels(scan, lidar.max_range).first;
    for (const auto& way : content.no_returns) scan.no_returns.push_back(to_scene * way);
    const auto [all, hidden] = freeVoxels(scan, lidar.max_range);
    EXPECT_EQ(hidden, 0u);
    EXPECT_GT(all, without + 300);
  }
}

}  // namespace
}  // namespace bki_mapping::ros_interface
