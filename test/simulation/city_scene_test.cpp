// The simulated city: drives that stay in their lanes, in one frame, each with its own traffic.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

#include "refusal_of.h"
#include "simulation/city.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

CityConfig smallCity() {
  CityConfig city;
  city.drives = 3;
  city.blocks = 2;
  city.block_edge = 70.0;
  city.drive.scans = 60;
  city.drive.lidar.rate = 1.0;
  city.drive.lidar.beams = 8;
  city.drive.lidar.columns = 180;
  city.drive.lidar.range_noise = 0.0;
  return city;
}

TEST(CityRoute, IsContinuousAndClosesALoopInTheRightLane) {
  const double edge = 70.0, length = 1000.0;
  for (std::uint64_t drive = 0; drive < 20; ++drive) {
    const CityRoute route(3, edge, length, 5, drive);
    bool closed = false;
    for (double way = 0.1; way <= length; way += 0.1) {
      const Eigen::Isometry3d T = route.at(way), before = route.at(way - 0.1);
      ASSERT_NEAR((T.translation() - before.translation()).norm(), 0.1, 1e-4) << way;
      const Eigen::Vector3d along = T.linear() * Eigen::Vector3d::UnitX();
      ASSERT_GT(along.dot(before.linear() * Eigen::Vector3d::UnitX()), 0.999) << way;
      ASSERT_GT((T.translation() - before.translation()).normalized().dot(along), 0.999) << way;
      closed = closed || (way > 100.0 && (T.translation() - route.at(0.0).translation()).norm() < 0.2);
      // Between crossings: in the right lane of a street of the city.
      const Eigen::Vector3d right = T.linear() * -Eigen::Vector3d::UnitY(), p = T.translation();
      const int across = std::abs(along.x()) > std::abs(along.y()) ? 1 : 0;
      const double forward = p[1 - across], street = std::round(p[across] / edge);
      if (std::abs(forward - edge * std::round(forward / edge)) < 12.0) continue;
      ASSERT_NEAR(p[across] - edge * street, 1.5 * right[across], 1e-6) << way;
      ASSERT_TRUE(street >= 0.0 && street <= 3.0) << way;
    }
    EXPECT_TRUE(closed) << drive;
  }
}

TEST(City, NobodyIsRunOver) {
  const City city(smallCity());
  for (std::size_t d = 0; d < city.size(); ++d) {
    const CityDrive drive = city.drive(d);
    const CityRoute route(2, 70.0, 8.0 * 60.0, 1, d);
    for (double time = 0.0; time < 60.0; time += 0.05) {
      const Eigen::Vector3d sensor = route.at(8.0 * time).translation();
      for (const double z : {0.5, 1.0}) {
        EXPECT_FALSE(drive.scene().labelAt({sensor.x(), sensor.y(), z}, time)) << d << " at " << time << " s";
      }
    }
  }
}

/// What stands in a scene, by label and place.
std::set<std::tuple<std::uint32_t, double, double>> standing(const Scene& scene) {
  std::set<std::tuple<std::uint32_t, double, double>> found;
  for (const Shape& s : scene.shapes) {
    if (s.velocity.isZero()) found.emplace(s.label, s.centre.x(), s.centre.y());
  }
  return found;
}

TEST(City, DrivesShareHousesButNotTraffic) {
  const City city(smallCity());
  const auto common = standing(city.scene());
  const CityDrive a = city.drive(0), b = city.drive(1);
  for (const CityDrive* drive : {&a, &b}) {
    const auto all = standing(drive->scene());
    for (const auto& each : common) EXPECT_TRUE(all.count(each));
  }
  const auto in_a = standing(a.scene()), in_b = standing(b.scene());
  std::size_t cars_of_one = 0;
  for (const auto& each : in_a) cars_of_one += std::get<0>(each) == kCar && !in_b.count(each);
  EXPECT_GT(cars_of_one, 5u) << "some parking spaces change";
  for (const std::uint32_t label : {kMovingCar, kMovingPerson, kPerson}) {
    std::size_t count = 0;
    for (const Shape& s : a.scene().shapes) count += s.label == label;
    EXPECT_GT(count, 10u) << label;
  }
}

/// The points of static things and of the ground lie on the surfaces of the city, seen from any drive: all
/// drives are in one frame.
TEST(City, AllDrivesAreInTheFrameOfTheCity) {
  const City city(smallCity());
  std::set<std::uint32_t> labels;
  for (std::size_t d = 0; d < city.size(); ++d) {
    const SequenceFrame frame = city.drive(d).frame(7);
    ASSERT_GT(frame.points.size(), 300u);
    for (std::size_t p = 0; p < frame.points.size(); ++p) {
      const std::uint32_t label = frame.labels[p];
      labels.insert(label);
      if (label != kBuilding && label != 40 && label != 48) continue;
      const Eigen::Vector3d at = frame.T_map_sensor * frame.points[p].cast<double>();
      const Eigen::Vector3d beam = (at - frame.T_map_sensor.translation()).normalized();
      EXPECT_EQ(city.scene().labelAt(at + 1e-3 * beam, 0.0), label) << d << ": " << at.transpose();
      EXPECT_FALSE(city.scene().labelAt(at - 1e-2 * beam, 0.0)) << d << ": " << at.transpose();
    }
  }
  for (const std::uint32_t label : {40u, 48u, kBuilding, kCar, kTrunk})
    EXPECT_TRUE(labels.count(label)) << label;
}

TEST(City, EqualSettingsGiveEqualScans) {
  const CityConfig config = smallCity();
  CityConfig other = config;
  other.drive.seed = 2;
  const SequenceFrame a = City(config).drive(1).frame(9), b = City(config).drive(1).frame(9),
                      c = City(other).drive(1).frame(9);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.T_map_sensor.matrix(), b.T_map_sensor.matrix());
  EXPECT_NE(a.points, c.points);
}

TEST(City, SettingsBeyondTheirLimitsAreRefused) {
  const auto refused = [](auto&& change, const std::string& words) {
    CityConfig config = smallCity();
    change(config);
    const std::string text = refusalOf([&] { City{config}; });
    EXPECT_NE(text.find(words), std::string::npos) << "'" << text << "' should be: " << words;
  };
  refused([](CityConfig& c) { c.drives = 0; }, "drives is 0, but must be from 1 to 10000");
  refused([](CityConfig& c) { c.blocks = 101; }, "blocks is 101");
  refused([](CityConfig& c) { c.block_edge = NAN; }, "block-edge is nan");
  refused([](CityConfig& c) { c.blocks = 100, c.block_edge = 1000.0; }, "500 km");
  refused([](CityConfig& c) { c.drive.scans = 0; }, "scans is 0");
  refused([](CityConfig& c) { c.drive.scans = 100000; }, "10000 s");
}

}  // namespace
}  // namespace bki_mapping::simulation
