// Scans from clouds and tf: origin of the beams, times of points, labels in every encoding.
#include <console_bridge/console.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "cloud_maker.h"
#include "refusal_of.h"
#include "ros/pose_conversion.h"
#include "ros/scan_reader.h"
#include "spinning_lidar.h"

namespace bki_mapping::ros_interface {
namespace {

using sensor_msgs::PointField;

const std::shared_ptr<const ClassTable>& classes() {
  static const auto table = std::make_shared<const ClassTable>(loadClassTable("semantic_kitti"));
  return table;
}

class Reader : public testing::Test {
 protected:
  void pose(const std::string& child, double seconds, const Eigen::Vector3d& position, double yaw = 0.0,
            const std::string& parent = "map") {
    geometry_msgs::TransformStamped t;
    t.header.frame_id = parent;
    t.header.stamp = ros::Time(seconds);
    t.child_frame_id = child;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translate(position).rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
    t.transform = toTransform(T);
    poses_.add(t);
  }

  /// A cloud of cars in the frame `sensor` at 100 s.
  static CloudMaker cloud(const std::vector<Eigen::Vector3f>& points) {
    CloudMaker maker(points);
    maker.add("label", PointField::UINT32, std::vector<double>(points.size(), 10.0));
    return maker;
  }

  std::variant<PlacedScan, MissingPose> read(const sensor_msgs::PointCloud2& cloud) const {
    return ScanReader(input_, "map", *classes(), LabelValues::kRaw).read(cloud, poses_);
  }
  bool ready(const sensor_msgs::PointCloud2& cloud) const {
    return ScanReader(input_, "map", *classes(), LabelValues::kRaw).ready(cloud, poses_);
  }
  PlacedScan placed(const sensor_msgs::PointCloud2& cloud) const { return std::get<PlacedScan>(read(cloud)); }
  DropReason reason(const sensor_msgs::PointCloud2& cloud) const {
    EXPECT_FALSE(ready(cloud));
    return std::get<MissingPose>(read(cloud)).reason;
  }

  InputConfig input_;
  PoseSource poses_;
};

TEST_F(Reader, MissingPosesAreToldApart) {
  sensor_msgs::PointCloud2 scan = cloud({{1, 0, 0}}).message();
  EXPECT_EQ(reason(scan), DropReason::kUnknownFrame);
  pose("other", 100.0, {0, 0, 0});
  for (const double t : {90.0, 100.0}) pose("sensor", t, {0, 0, 0}, 0.0, "island");
  EXPECT_EQ(reason(scan), DropReason::kNoTransform);
  pose("island", 90.0, {0, 0, 0});
  pose("island", 95.0, {0, 0, 0});
  EXPECT_EQ(reason(scan), DropReason::kTransformLate);
  pose("island", 101.0, {0, 0, 0});
  EXPECT_TRUE(ready(scan));
  EXPECT_TRUE(std::holds_alternative<PlacedScan>(read(scan)));
  scan.header.stamp = ros::Time(80.0);
  EXPECT_EQ(reason(scan), DropReason::kTooOld);
  scan.header.stamp = ros::Time(4294967295u, 0u);  // the latest possible stamp
  EXPECT_EQ(reason(scan), DropReason::kTransformLate);
  scan.header.frame_id = "";
  EXPECT_EQ(reason(scan), DropReason::kUnknownFrame);
}

TEST_F(Reader, NonsenseFromTfIsNoPose) {
  const sensor_msgs::PointCloud2 scan = cloud({{1, 0, 0}}).message();
  pose("sensor", 100.0, {NAN, 0, 0});
  EXPECT_FALSE(ready(scan));
  geometry_msgs::TransformStamped t;
  t.header.frame_id = "map";
  t.header.stamp = ros::Time(100.0);
  t.child_frame_id = "sensor";
  t.transform.rotation.w = 2.0;  // not a rotation
  poses_.add(t);
  EXPECT_FALSE(ready(scan));
}

TEST_F(Reader, TimesAtTheEndOfTimeDoNoHarm) {
  const sensor_msgs::PointCloud2 scan = cloud({{1, 0, 0}}).message();
  pose("sensor", 100.0, {5, 0, 0});
  pose("sensor", 4294967295.0, {9, 0, 0});  // in 2106: tf2 cannot add 10 s to it
  poses_.restart(ros::Time(4294967290.0));  // adds the kept transforms again
  pose("sensor", 100.0, {5, 0, 0});
  EXPECT_TRUE(ready(scan));
  EXPECT_EQ(placed(scan).scan.origin.x(), 5.0);
}

TEST_F(Reader, NobodyChoosesHowMuchIsSaidOfAName) {
  for (const std::string& frame : {std::string(1000000, 'f'), std::string("f\n\0\033[2J", 7)}) {
    pose("sensor", 100.0, {0, 0, 0});
    CloudMaker maker = cloud({{1, 0, 0}});
    maker.frame = frame;
    std::string why = std::get<MissingPose>(read(maker.message())).why;
    EXPECT_LT(why.size(), 1000u);
    EXPECT_EQ(std::count_if(why.begin(), why.end(), [](unsigned char c) { return c < 0x20; }), 0) << why;
    pose(std::string(1000000, 'c'), 100.0, {0, 0, 0}, 0.0, frame);  // not connected to the map
    maker.frame = std::string(1000000, 'c');
    why = std::get<MissingPose>(read(maker.message())).why;
    EXPECT_LT(why.size(), 1000u);
  }
}

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child, double seconds,
                                          double x, double w) {
  geometry_msgs::TransformStamped t;
  t.header.frame_id = parent;
  t.header.stamp = ros::Time(seconds);
  t.child_frame_id = child;
  t.transform.translation.x = x;
  t.transform.rotation.w = w;
  return t;
}

TEST_F(Reader, ATransformThatIsNoPoseIsNamed) {
  const sensor_msgs::PointCloud2 scan = cloud({{1, 0, 0}}).message();
  const auto expectNamed = [&](const std::string& words) {
    EXPECT_FALSE(ready(scan));
    const auto placed = read(scan);
    ASSERT_TRUE(std::holds_alternative<MissingPose>(placed)) << words;
    const MissingPose missing = std::get<MissingPose>(placed);
    EXPECT_EQ(missing.reason, DropReason::kBadTransform) << missing.why;
    EXPECT_NE(missing.why.find(words), std::string::npos) << missing.why;
  };
  for (const auto& [x, w, words] : std::vector<std::tuple<double, double, std::string>>{
           {0.0, 5.0, "the norm of its quaternion is 5, not 1"},
           {0.0, 0.0, "the norm of its quaternion is 0, not 1"},
           {0.0, NAN, "its quaternion is not finite"},
           {NAN, 1.0, "its translation is not finite"},
           {INFINITY, 1.0, "its translation is not finite"}}) {
    poses_.add(transform("/map", "/sensor", 100.0, x, w));
    expectNamed(words);
    expectNamed("the transform from 'map' to 'sensor' of time 100 is not a pose");
  }
  pose("sensor", 100.0, {1, 2, 3});  // finally a valid one
  EXPECT_TRUE(ready(scan));
}

TEST_F(Reader, ARefusedTransformIsBlamedForWhatItCaused) {
  sensor_msgs::PointCloud2 scan = cloud({{1, 0, 0}}).message();
  poses_.add(transform("base", "sensor", 0.0, 1.0, 1.0), true);
  for (const double t : {96.0, 98.0}) poses_.add(transform("map", "base", t, t, 1.0));
  EXPECT_EQ(reason(scan), DropReason::kTransformLate);
  poses_.add(transform("map", "base", 100.0, 100.0, 2.0));
  EXPECT_EQ(reason(scan), DropReason::kBadTransform) << "also in the middle of the way";
  scan.header.stamp = ros::Time(90.0);
  EXPECT_EQ(reason(scan), DropReason::kTooOld) << "whatever came later";
  scan.header.stamp = ros::Time(100.5);
  poses_.add(transform("map", "base", 100.2, 100.2, 1.0));
  EXPECT_EQ(reason(scan), DropReason::kTransformLate) << "a good one came since";
  // Refused transforms of many frames are not kept for ever, but the latest ones are known.
  for (int i = 0; i < 100000; ++i) {
    poses_.add(transform("map", "frame_" + std::to_string(i), 100.0, 0.0, 2.0));
  }
  poses_.add(transform("map", "base", 100.3, 0.0, 2.0));
  EXPECT_EQ(reason(scan), DropReason::kBadTransform);
}

TEST_F(Reader, BothPosesOfAStampOfZeroAreOfOneTime) {
  for (const double t : {98.0, 99.0, 100.0}) pose("sensor", t, {t, 0, 0});
  for (const double t : {98.0, 99.5}) pose("merger", t, {0, t, 0});
  CloudMaker maker = cloud({{1, 0, 0}});
  maker.frame = "merger";
  maker.stamp = 0.0;
  input_.sensor_frame_id = "sensor";
  EXPECT_TRUE(ready(maker.message()));
  const Scan scan = placed(maker.message()).scan;
  EXPECT_TRUE(scan.origin.isApprox(Eigen::Vector3d(99.5, 0, 0), 1e-9)) << scan.origin;
  EXPECT_TRUE(scan.points[0].isApprox(Eigen::Vector3f(1.0f - 99.5f, 99.5f, 0.0f), 1e-5f));
  EXPECT_EQ(scan.stamp, 99500000000u);
  poses_.add(transform("map", "still", 0.0, 7.0, 1.0), true);
  input_.sensor_frame_id = "still";
  EXPECT_EQ(placed(maker.message()).scan.origin.x(), 7.0);
  EXPECT_EQ(placed(maker.message()).scan.points[0].y(), 99.5f);
}

TEST_F(Reader, WhenTimeJumpsBackTransformsOfTheNewTimeAreKept) {
  for (const double t : {98.0, 99.0, 100.0}) pose("sensor", t, {t, 0, 0});
  for (const double t : {20.0, 20.5})
    pose("sensor", t, {t, 0, 0});  // before the jump is detected; tf2 refuses them
  sensor_msgs::PointCloud2 scan = cloud({{1, 0, 0}}).message();
  scan.header.stamp = ros::Time(20.25);
  EXPECT_FALSE(ready(scan));
  poses_.restart(scan.header.stamp);
  EXPECT_NEAR(placed(scan).scan.origin.x(), 20.25, 1e-9);
  scan.header.stamp = ros::Time(99.5);
  EXPECT_FALSE(ready(scan));
}

TEST_F(Reader, AStampOfZeroMeansTheLatestPose) {
  pose("sensor", 99.0, {1, 0, 0});
  pose("sensor", 100.0, {2, 0, 0});
  sensor_msgs::PointCloud2 scan = cloud({{1, 0, 0}}).message();
  scan.header.stamp = ros::Time();
  EXPECT_EQ(placed(scan).scan.origin, Eigen::Vector3d(2, 0, 0));
  EXPECT_EQ(placed(scan).scan.stamp, 100000000000u);
}

TEST_F(Reader, BeamsStartWhereTheSensorIs) {
  pose("sensor", 100.0, {3, 4, 5}, 1.0);
  input_.sensor_frame_id = "sensor";
  CloudMaker maker = cloud({{10, 4, 5}});
  maker.frame = "map";
  const Scan scan = placed(maker.message()).scan;
  EXPECT_EQ(scan.origin, Eigen::Vector3d(3, 4, 5));
  EXPECT_TRUE(scan.points[0].isApprox(Eigen::Vector3f(7, 0, 0), 1e-6f));
  const ScanReader reader(input_, "map", *classes(), LabelValues::kRaw);
  EXPECT_FALSE(reader.originDoubtful(maker.message()));
  EXPECT_TRUE(
      ScanReader(InputConfig(), "map", *classes(), LabelValues::kRaw).originDoubtful(maker.message()));
}

TEST_F(Reader, DoublesOfAFarFrameAreAsExactAsNearIt) {
  Eigen::Isometry3d T_map_utm(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  T_map_utm.translation() = Eigen::Vector3d(3, -2, 1) - T_map_utm * Eigen::Vector3d(4e5, 5e6, 100);
  for (const double t : {99.0, 101.0}) {
    pose("sensor", t, {5.0 * (t - 100.0), 1, 2}, 0.1 * (t - 100.0));
    pose("utm", t, T_map_utm.translation(), 0.7);
    pose("near", t, {0, 0, 0});
  }
  std::vector<Eigen::Vector3d> near, far;
  std::vector<double> times;
  for (int n = 0; n < 200; ++n) {
    near.emplace_back(0.37 * n - 40.0, std::sin(n) * 60.0, 0.01 * n);
    far.push_back(T_map_utm.inverse() * near.back());
    times.push_back(0.0005 * n);
  }
  input_.sensor_frame_id = "sensor";
  const auto scanOf = [&](const std::vector<Eigen::Vector3d>& points, const std::string& frame) {
    CloudMaker maker = CloudMaker::inDoubles(points);
    maker.add("label", PointField::UINT32, std::vector<double>(points.size(), 10.0));
    maker.add("t", PointField::FLOAT64, times);
    maker.frame = frame;
    return placed(maker.message()).scan;
  };
  for (const char* time_field : {"", "t"}) {
    input_.time_field = time_field;
    const Scan a = scanOf(near, "near"), b = scanOf(far, "utm");
    EXPECT_TRUE(a.origin.isApprox(b.origin, 1e-9));
    ASSERT_EQ(b.points.size(), near.size());
    for (std::size_t n = 0; n < near.size(); ++n) {
      ASSERT_LT((a.points[n] - b.points[n]).norm(), 1e-4f) << n;
      ASSERT_LT((b.origin + b.points[n].cast<double>() - near[n]).norm(), 1e-4) << n;
    }
  }
  // Zeros, which drivers write where nothing came back, need no time there either, and are no returns.
  far[7].setZero();
  far[8] = T_map_utm.inverse() * Eigen::Vector3d(0, 1, 2);  // the sensor
  times[7] = times[8] = NAN;
  EXPECT_TRUE(scanOf(far, "utm").points[7].allFinite());
  input_.time_field = "";
  input_.clear_no_returns = true;
  const Scan scan = scanOf(far, "utm");
  EXPECT_EQ(scan.points.size(), far.size() - 2);
  EXPECT_EQ(scan.no_returns.size(), 2u);
}

TEST_F(Reader, PointsArePutWhereTheSensorWasAtTheirTime) {
  // Moving forwards at 10 m/s: after 0.1 s, a wall at x = 20 is 1 m nearer.
  pose("sensor", 99.0, {-10, 0, 0});
  pose("sensor", 101.0, {10, 0, 0});
  const std::vector<Eigen::Vector3f> points = {{20, 0, 0}, {19.5f, 1, 0}, {19, 2, 0}};
  for (const bool nanoseconds : {false, true}) {
    CloudMaker maker = cloud(points);
    if (nanoseconds) {
      maker.add("t", PointField::UINT32, {0, 50e6, 100e6});
    } else {
      maker.add("t", PointField::FLOAT32, {0.0, 0.05, 0.1});
    }
    input_.time_field = "";
    EXPECT_NEAR(placed(maker.message()).scan.points[2].x(), 19.0, 1e-4);
    input_.time_field = "t";
    const Scan scan = placed(maker.message()).scan;
    EXPECT_TRUE(scan.origin.isZero(1e-9));
    for (const auto& point : scan.points) EXPECT_NEAR(point.x(), 20.0, 0.011);  // half a time slice
  }
  // tf must have the end of the scan, too.
  CloudMaker maker = cloud(points);
  maker.add("t", PointField::FLOAT64, {0.0, 0.5, 1.5});
  EXPECT_EQ(reason(maker.message()), DropReason::kTransformLate);
  CloudMaker nonsense = cloud(points);
  nonsense.add("t", PointField::FLOAT64, {0.0, 0.1, NAN});
  EXPECT_TRUE(ready(nonsense.message()));
  const Scan partly = placed(nonsense.message()).scan;
  EXPECT_NEAR(partly.points[1].x(), 20.5, 0.011);
  EXPECT_FALSE(partly.points[2].allFinite()) << "counted as such a point";
  input_.time_field = "no such field";
  EXPECT_THROW(read(maker.message()), std::invalid_argument);
}

TEST_F(Reader, APointHasThePoseOfItsTimeWhateverThisCountsFrom) {
  // The sensor moves forwards at 10 m/s. A wall at x = 20 is seen for 0.1 s.
  const double stamp = 1.7e9;
  for (double t = -1.0; t < 1.05; t += 0.1) pose("sensor", stamp + t, {10.0 * t, 0, 0});
  constexpr std::size_t kPoints = 500;
  const auto wall = [&](double first) {  // the time of the first point after the stamp [s]
    std::vector<Eigen::Vector3f> points;
    for (std::size_t n = 0; n < kPoints; ++n) {
      points.emplace_back(static_cast<float>(20.0 - 10.0 * (first + 0.1 * static_cast<double>(n) / kPoints)),
                          1.0f, 0.0f);
    }
    return points;
  };
  struct Case {
    double first;  ///< true time of the first point after the stamp [s]
    std::uint8_t datatype;
    double zero, scale;  ///< raw = zero + scale * (seconds after the stamp)
    TimeReference reference;
  };
  constexpr auto kAuto = TimeReference::kAuto;
  for (const Case& c : std::vector<Case>{{0.0, PointField::FLOAT64, stamp, 1.0, kAuto},
                                         {-0.1, PointField::FLOAT64, stamp, 1.0, kAuto},
                                         {-0.05, PointField::FLOAT64, 1e9 * stamp, 1e9, kAuto},
                                         {-0.1, PointField::FLOAT32, 0.0, 1.0, kAuto},
                                         {0.0, PointField::UINT32, 0.0, 1e6, kAuto},
                                         {-0.1, PointField::INT32, 0.0, 1e9, kAuto},
                                         {-0.1, PointField::FLOAT32, 0.0, -1.0, TimeReference::kUntilStamp},
                                         {-0.1, PointField::UINT32, 3e9, 1e6, TimeReference::kScanEnd}}) {
    std::vector<double> times;
    for (std::size_t n = 0; n < kPoints; ++n) {
      times.push_back(c.zero + c.scale * (c.first + 0.1 * static_cast<double>(n) / kPoints));
    }
    CloudMaker maker = cloud(wall(c.first));
    maker.add("t", c.datatype, times);
    maker.stamp = stamp;
    input_.time_field = "t";
    input_.time_reference = c.reference;
    EXPECT_TRUE(ready(maker.message()));
    const PlacedScan scan = placed(maker.message());
    for (const auto& point : scan.scan.points)
      ASSERT_NEAR(point.x(), 20.0, 0.011) << c.first << ", " << c.scale;
    EXPECT_NE(scan.times, "");
  }
}

TEST_F(Reader, ACloudIsReadyWhenItsLastPoseIsThere) {
  for (const bool first_is_last : {false, true}) {
    poses_.restart(ros::Time(0.1));
    CloudMaker maker = cloud({{20, 0, 0}, {20, 1, 0}, {20, 2, 0}, {0, 0, 0}});
    maker.add("t", PointField::FLOAT64,
              first_is_last ? std::vector<double>{0.1, 0.05, -0.1, 9.0}
                            : std::vector<double>{-0.1, 0.05, 0.1, 9.0});
    input_.time_field = "t";
    for (const auto& [time, there] :
         std::vector<std::pair<double, bool>>{{99.95, false}, {100.05, false}, {100.2, true}}) {
      pose("sensor", time, {0, 0, 0});
      EXPECT_FALSE(ready(maker.message())) << "the first points are older";
      EXPECT_FALSE(there && std::holds_alternative<PlacedScan>(read(maker.message())));
    }
    poses_.restart(ros::Time(0.1));
    pose("sensor", 99.8, {0, 0, 0});
    for (const auto& [time, there] :
         std::vector<std::pair<double, bool>>{{99.95, false}, {100.05, false}, {100.2, true}}) {
      pose("sensor", time, {0, 0, 0});
      EXPECT_EQ(ready(maker.message()), there) << time;
      EXPECT_EQ(std::holds_alternative<PlacedScan>(read(maker.message())), there) << time;
    }
  }
}

/// Counts the lines that tf2 prints by itself.
class Tf2Lines : public console_bridge::OutputHandler {
 public:
  Tf2Lines() { console_bridge::useOutputHandler(this); }
  ~Tf2Lines() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string&, console_bridge::LogLevel, const char*, int) override { ++count; }
  int count = 0;
};

TEST_F(Reader, FramesMayBeginWithOneSlash) {
  Tf2Lines lines;
  pose("/base", 99.0, {1, 0, 0}, 0.0, "/map");
  pose("base", 101.0, {3, 0, 0}, 0.0, "map");
  poses_.add(transform("/base", "sensor", 0.0, 10.0, 1.0), true);
  for (const char* frame : {"sensor", "/sensor"}) {
    for (const char* sensor : {"", "base", "/base"}) {
      for (const char* map : {"map", "/map"}) {
        CloudMaker maker = cloud({{1, 0, 0}});
        maker.frame = frame;
        input_.sensor_frame_id = sensor;
        const ScanReader reader(input_, map, *classes(), LabelValues::kRaw);
        EXPECT_TRUE(reader.ready(maker.message(), poses_)) << frame << sensor << map;
        const auto scan = std::get<PlacedScan>(reader.read(maker.message(), poses_)).scan;
        EXPECT_NEAR(scan.origin.x(), *sensor ? 2.0 : 12.0, 1e-9);
        EXPECT_NEAR(scan.origin.x() + static_cast<double>(scan.points[0].x()), 13.0, 1e-5);
      }
    }
  }
  CloudMaker maker = cloud({{1, 0, 0}});
  maker.frame = "/map";
  EXPECT_TRUE(
      ScanReader(InputConfig(), "map", *classes(), LabelValues::kRaw).originDoubtful(maker.message()));
  EXPECT_EQ(lines.count, 0);
}

TEST_F(Reader, OneBadFrameMakesTf2PrintNothing) {
  Tf2Lines lines;
  pose("sensor", 100.0, {0, 0, 0});
  for (const char* frame : {"", "/", "//sensor", "/nowhere", "nowhere"}) {
    CloudMaker maker = cloud({{1, 0, 0}});
    maker.frame = frame;
    for (int n = 0; n < 98; ++n) EXPECT_FALSE(ready(maker.message()));
    const auto missing = std::get<MissingPose>(read(maker.message()));
    EXPECT_EQ(missing.reason, DropReason::kUnknownFrame) << missing.why;
    EXPECT_GT(missing.why.size(), 20u);
  }
  for (const auto& [parent, child] : std::vector<std::pair<std::string, std::string>>{
           {"map", "map"}, {"/map", "map"}, {"", "a"}, {"map", ""}, {"/", "b"}}) {
    for (int n = 0; n < 10; ++n) poses_.add(transform(parent, child, 100.0 + n, 0.0, 1.0));
  }
  EXPECT_EQ(lines.count, 0);
}

TEST_F(Reader, AWrongClockIsNamed) {
  const double now = 1.7e9;
  for (double t = -5.0; t < 0.05; t += 0.1) pose("sensor", now + t, {0, 0, 0});
  const auto why = [&](double stamp, double computer) {
    CloudMaker maker = cloud({{1, 0, 0}});
    maker.stamp = stamp;
    const ScanReader reader(input_, "map", *classes(), LabelValues::kRaw);
    return std::get<MissingPose>(reader.read(maker.message(), poses_, ros::Time(computer))).why;
  };
  const auto expect = [](const std::string& text, const std::vector<std::string>& words) {
    for (const auto& word : words) EXPECT_NE(text.find(word), std::string::npos) << word << ": " << text;
  };
  expect(why(now + 0.5, now), {"500 ms older than the cloud", "raise tf_timeout"});
  expect(why(now + 37.2, now), {"37.2 s ahead of the latest", "'sensor' to 'map'", "TAI"});
  EXPECT_EQ(why(now + 37.2, now).find("tf_timeout"), std::string::npos);
  expect(why(now - 37.0, now), {"37 s behind", "TAI"});
  expect(why(300.0, now), {"53.9 years behind", "since the sensor's start"});
  expect(why(now + 60.0, now + 60.1), {"older than the cloud", "has stopped"});
  expect(why(now - 7.0, now), {"do not reach back", "7 s newer"});
}

TEST_F(Reader, JumpsOnTheWayToTheMapAreNoticed) {
  poses_.add(transform("base", "sensor", 0.0, 1.0, 1.0), true);
  const auto drive = [&](double from, double correction) {
    for (int n = 0; n < 10; ++n) {
      const double t = from + 0.1 * n;
      pose("odom", t, {correction, 0, 0});
      pose("base", t, {10.0 * t, 0, 0}, 0.0, "odom");
      pose("wheel", t, {0, 0, 0}, n % 2 == 0 ? 0.0 : 3.0, "base");
    }
  };
  drive(100.0, 0.0);  // before the first scan
  poses_.watchJumps("map", "sensor", ros::Time(100.5));
  drive(101.0, 3.0);
  const auto jumps = poses_.takeJumps();
  ASSERT_EQ(jumps.size(), 1u);
  EXPECT_EQ(jumps[0].parent, "map");
  EXPECT_EQ(jumps[0].child, "odom");
  EXPECT_NEAR(jumps[0].distance, 3.0, 1e-6);
  drive(102.0, 3.0);
  poses_.restart(ros::Time(20.0));
  drive(20.0, -7.0);
  poses_.watchJumps("map", "sensor", ros::Time(20.5));
  drive(21.0, -7.0);
  EXPECT_TRUE(poses_.takeJumps().empty());
}

TEST_F(Reader, ACloudInMillimetresIsRefused) {
  pose("sensor", 100.0, {5000, 0, 0});
  EXPECT_NO_THROW(read(cloud({{5, 0, 0}, {0, 50, 0}, {1, 2, 3}}).message()));
  const auto millimetres = cloud({{5000, 0, 0}, {0, 50000, 0}, {1000, 2000, 3000}, {0, 0, 0}}).message();
  const std::string refusal = refusalOf([&] { read(millimetres); });
  EXPECT_NE(refusal.find("5000 m from the sensor (median)"), std::string::npos) << refusal;
  input_.sensor_model.max_range = 100000.0;
  EXPECT_NO_THROW(read(millimetres)) << "an airborne sensor";
  input_.sensor_model.max_range = 60.0;
  EXPECT_THROW(read(millimetres), std::invalid_argument) << "each beam would clear 60 m";
  EXPECT_NO_THROW(read(cloud({{0, 0, 0}, {NAN, NAN, NAN}}).message())) << "a sensor that sees nothing";
  EXPECT_NO_THROW(read(cloud({{500, 0, 0}, {600, 0, 0}, {10, 0, 0}}).message()));
  EXPECT_NO_THROW(read(cloud({{655.35f, 0, 0}, {0, 655.35f, 0}, {0, 0, 655.35f}}).message())) << "no returns";
}

TEST_F(Reader, InTheAxesOfTheSensorAScanDoesNotDependOnThePose) {
  const std::vector<Eigen::Vector3f> points = {{20.1f, 0.3f, -1.7f}, {-3.3f, 7.7f, 0.1f}, {0, 0, 0}};
  const auto inSensor = [&](const sensor_msgs::PointCloud2& message) {
    return std::get<PlacedScan>(ScanReader(input_, "map", *classes(), LabelValues::kRaw, ScanAxes::kSensor)
                                    .read(message, poses_))
        .scan;
  };
  for (const double yaw : {0.0, 2.0}) {
    const std::string sensor = yaw == 0.0 ? "sensor" : "turned", other = sensor + "_base";
    pose(other, 100.0, {0.5, -0.2, 1.0}, 0.7, sensor);
    for (const double t : {99.0, 100.0, 101.0}) {
      // Along its x axis at 10 m/s.
      const double along = 10.0 * (t - 100.0);
      pose(sensor, t, {1e4 + along * std::cos(yaw), -70.0 + along * std::sin(yaw), 3.0}, yaw);
    }
    input_ = {};
    input_.clear_no_returns = true;
    CloudMaker maker = cloud(points);
    maker.frame = sensor;
    const Scan scan = inSensor(maker.message());
    EXPECT_EQ(scan.origin, Eigen::Vector3d(1e4, -70.0, 3.0));
    ASSERT_EQ(scan.points.size(), 2u);
    EXPECT_EQ(scan.points[0], points[0]) << "to the bit";
    EXPECT_EQ(scan.points[1], points[1]);
    EXPECT_EQ(scan.no_returns.size(), 1u);

    input_.sensor_frame_id = other;
    const Scan from_base = inSensor(maker.message());
    EXPECT_LT((from_base.points[0] - Eigen::AngleAxisf(-0.7f, Eigen::Vector3f::UnitZ()) *
                                         (points[0] - Eigen::Vector3f(0.5f, -0.2f, 1.0f)))
                  .norm(),
              1e-5f);

    input_ = {};
    input_.time_field = "t";
    maker.add("t", PointField::FLOAT64, {0.0, 0.5, 0.0});
    const Scan moved = inSensor(maker.message());
    EXPECT_LT((moved.points[1] - points[1] - Eigen::Vector3f(5, 0, 0)).norm(), 0.011f);  // half a time slice
  }
}

TEST_F(Reader, HolesTurnWithTheSensorLikeTheirFiring) {
  pose("sensor", 99.0, {0, 0, 0}, -1.0);  // turns at 1 rad/s: by eight beams in a scan
  pose("sensor", 101.0, {0, 0, 0}, 1.0);
  const SpinningLidar lidar;
  const OrganisedCloud sweep_of_lidar = sweep(lidar, BoxScene::street());
  const auto timeOf = [&](std::size_t i) {
    return 0.1 * static_cast<double>(i % sweep_of_lidar.width) / static_cast<double>(sweep_of_lidar.width);
  };
  const std::vector<std::size_t> holes = sweep_of_lidar.holes();
  for (const double time_of_holes : {0.0, 1e30}) {  // what drivers write for points that are none
    std::vector<double> times;
    for (std::size_t i = 0; i < sweep_of_lidar.points.size(); ++i) times.push_back(timeOf(i));
    for (const std::size_t i : holes) times[i] = time_of_holes;
    sensor_msgs::PointCloud2 message =
        cloud(sweep_of_lidar.points).add("t", PointField::FLOAT64, times).message();
    message.width = static_cast<std::uint32_t>(sweep_of_lidar.width);
    message.height = static_cast<std::uint32_t>(sweep_of_lidar.points.size() / sweep_of_lidar.width);
    message.row_step = message.width * message.point_step;
    input_.time_field = "t";
    input_.clear_no_returns = true;
    const PlacedScan read_scan = placed(message);
    ASSERT_EQ(read_scan.scan.no_returns.size(), holes.size());
    EXPECT_FALSE(read_scan.no_direction);
    for (std::size_t i = 0; i < holes.size(); ++i) {
      const auto yaw = static_cast<float>(timeOf(holes[i]));
      const Eigen::Vector3f expected =
          Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitZ()) * sweep_of_lidar.truth[holes[i]];
      const Eigen::Vector3f& found = read_scan.scan.no_returns[i];
      ASSERT_LT((found - expected).norm(), lidar.spacing()) << i;
    }
  }
}

TEST_F(Reader, CloudsOfOnePointAndOfTwoMillion) {
  pose("sensor", 100.0, {0, 0, 0});
  MapperConfig config;
  config.free_space.mode = "none";
  SemanticMapper mapper(config, classes());
  EXPECT_EQ(mapper.integrate(placed(cloud({{1, 2, 3}}).message()).scan).counts.used, 1u);
  std::vector<Eigen::Vector3f> many;
  for (int i = 0; i < 2000000; ++i) {
    const float a = 1e-4f * static_cast<float>(i);
    many.emplace_back(30.0f * std::cos(a), 30.0f * std::sin(a), 1e-6f * static_cast<float>(i));
  }
  const ScanStats stats = mapper.integrate(placed(cloud(many).message()).scan);
  EXPECT_EQ(stats.counts.used, 2000000u);
  EXPECT_GT(stats.hits, 1000u);
}

/// Values that only faulty sensors and networks produce.
std::vector<double> extremes() {
  using F = std::numeric_limits<float>;
  using D = std::numeric_limits<double>;
  std::vector<double> values = {0.0, 0.1, 1.0, 10.0, 255.0, 4294967295.0, NAN, 1e39};
  for (const double x : {static_cast<double>(F::denorm_min()), static_cast<double>(F::min()),
                         static_cast<double>(F::max()), D::denorm_min(), D::max(), D::infinity()}) {
    values.push_back(x);
  }
  for (std::size_t i = 0, n = values.size(); i < n; ++i) values.push_back(-values[i]);
  return values;
}

/// Every probability is positive and finite; those of a point add up to 1, unless it has none.
void expectShares(const SoftLabels& soft) {
  for (std::size_t i = 0; i < soft.size(); ++i) {
    double sum = 0.0;
    for (const ClassShare* s = soft.begin(i); s != soft.end(i); ++s) {
      ASSERT_TRUE(std::isfinite(s->share) && s->share > 0.0f) << s->share;
      sum += s->share;
    }
    if (soft.begin(i) != soft.end(i)) {
      ASSERT_NEAR(sum, 1.0, 1e-6);
    }
  }
}

void expectSaneEvidence(const SemanticMap& map) {
  for (const auto& entry : map.entries()) {
    for (int v = 0; v < kBlockVoxels; ++v) {
      const VoxelView view = viewWithoutEntropy(map, StateRules(), entry.index, *entry.block, v);
      ASSERT_TRUE(std::isfinite(view.probability) && std::isfinite(view.variance));
      for (const ClassId id : entry.block->classes()) {
        ASSERT_GE(entry.block->evidence(id)[v], 0) << "class " << int{id};
      }
    }
  }
}

TEST_F(Reader, NoLabelOrScoreBringsNonsenseIntoTheMap) {
  pose("sensor", 100.0, {0, 0, 0});
  // A point for each pair of extreme values, 1 m from one another.
  std::vector<Eigen::Vector3f> points;
  std::vector<double> a, b, car, road;
  for (const double x : extremes()) {
    for (const double y : extremes()) {
      const auto n = static_cast<float>(points.size());
      points.emplace_back(3.5f + std::fmod(n, 30.0f), 0.5f + std::floor(n / 30.0f), 0.5f);
      a.push_back(x);
      b.push_back(y);
      car.push_back(10.0);
      road.push_back(40.0);
    }
  }
  for (const std::uint8_t type :
       {PointField::INT8, PointField::UINT8, PointField::INT16, PointField::UINT16, PointField::INT32,
        PointField::UINT32, PointField::FLOAT32, PointField::FLOAT64}) {
    CloudMaker maker(points);
    maker.add("a", type, a).add("b", type, b);
    maker.add("car", PointField::UINT8, car).add("road", PointField::UINT8, road);
    const sensor_msgs::PointCloud2 message = maker.message();
    const auto flood = [&](LabelEncoding encoding, const std::string& labels, const std::string& scores) {
      input_.label_encoding = encoding;
      input_.label_field = labels;
      input_.score_fields = scores;
      for (const ScoreType score : {ScoreType::kProbability, ScoreType::kLogit}) {
        for (const ColorMatch match : {ColorMatch::kExact, ColorMatch::kNearest}) {
          input_.score_type = score;
          input_.color_match = match;
          SCOPED_TRACE("datatype " + std::to_string(type) + ", labels " + labels + ", scores " + scores);
          const Scan scan = placed(message).scan;
          expectShares(scan.soft);
          SemanticMapper mapper(MapperConfig(), classes());
          const PointCounts counts = mapper.integrate(scan).counts;
          EXPECT_EQ(counts.points, counts.used + counts.unknown_label);
          expectSaneEvidence(mapper.map());
        }
      }
    };
    flood(LabelEncoding::kNumber, "a", "");
    for (const auto encoding : {LabelEncoding::kRgb, LabelEncoding::kBgr}) {
      flood(encoding, "a", "");
      flood(encoding, "a,b,a", "");
    }
    flood(LabelEncoding::kScores, "", "car=a,road=b");
    flood(LabelEncoding::kTopK, "car,road", "a,b");  // extreme scores
    flood(LabelEncoding::kTopK, "a,b", "car,road");  // extreme labels
    flood(LabelEncoding::kTopK, "car,car", "a,b");   // the same label twice
    if (HasFatalFailure()) return;
  }
}

TEST_F(Reader, SureLabelsGiveTheSameMapInEveryEncoding) {
  pose("sensor", 100.0, {0.3, 0.2, 0.1}, 0.4);
  std::vector<Eigen::Vector3f> points;
  std::vector<double> raw, color, car, road, first, sure, second, unsure;
  for (int i = 0; i < 3000; ++i) {
    const float a = 0.01f * static_cast<float>(i);
    points.emplace_back(5.0f * std::cos(a), 5.0f * std::sin(a), 0.0005f * static_cast<float>(i % 700));
    const bool is_car = i % 3 == 0;
    const SemanticClass& c = *classes()->find(is_car ? 1 : 9);
    raw.push_back(is_car ? 10 : 40);
    color.push_back(c.color[0] << 16 | c.color[1] << 8 | c.color[2]);
    car.push_back(is_car);
    road.push_back(!is_car);
    first.push_back(raw.back());
    sure.push_back(1.0);
    second.push_back(is_car ? 40 : 10);
    unsure.push_back(0.0);
  }
  const auto mapOf = [&](const CloudMaker& maker) {
    auto mapper = std::make_unique<SemanticMapper>(MapperConfig(), classes());
    mapper->integrate(placed(maker.message()).scan);
    return mapper;
  };
  CloudMaker numbers(points);
  numbers.add("label", PointField::UINT16, raw);
  const auto expected = mapOf(numbers);
  ASSERT_GT(expected->map().size(), 20u);
  const auto expectSame = [&](const CloudMaker& maker, const std::string& what) {
    const auto mapper = mapOf(maker);
    ASSERT_EQ(mapper->map().size(), expected->map().size()) << what;
    for (const auto& entry : expected->map().entries()) {
      const Block* block = mapper->map().find(entry.index);
      ASSERT_TRUE(block) << what;
      for (const ClassId id : entry.block->classes()) {
        ASSERT_EQ(0, std::memcmp(block->evidence(id), entry.block->evidence(id),
                                 sizeof(EvidenceUnits) * kBlockVoxels))
            << what;
      }
    }
  };
  CloudMaker floats(points);
  floats.add("label", PointField::FLOAT32, raw);
  expectSame(floats, "float");
  CloudMaker colors(points);
  colors.add("rgb", PointField::UINT32, color);
  input_.label_field = "rgb";
  input_.label_encoding = LabelEncoding::kRgb;
  expectSame(colors, "rgb");
  CloudMaker scores(points);
  scores.add("a", PointField::FLOAT32, car).add("b", PointField::FLOAT32, road);
  input_.label_encoding = LabelEncoding::kScores;
  input_.score_fields = "car=a,road=b";
  expectSame(scores, "scores");
  CloudMaker top(points);
  top.add("l1", PointField::UINT8, first).add("p1", PointField::FLOAT32, sure);
  top.add("l2", PointField::UINT8, second).add("p2", PointField::FLOAT32, unsure);
  input_.label_encoding = LabelEncoding::kTopK;
  input_.label_field = "l1,l2";
  input_.score_fields = "p1,p2";
  expectSame(top, "top_k");
}

}  // namespace
}  // namespace bki_mapping::ros_interface
