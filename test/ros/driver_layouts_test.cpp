// Clouds as drivers publish them: fields, datatypes, offsets, point_step, what a beam without a return looks
// like, and what times count from. Each is read with the settings that docs/parameters.md recommends.
//
// Layouts are those of the drivers' sources: ros-drivers/velodyne (velodyne_pointcloud/src/conversions),
// ouster-lidar/ouster-ros (os_point.h), HesaiTechnology/HesaiLidar_ROS_2.0 (source_driver_ros1.hpp) and the
// older HesaiLidar_General_ROS, Livox-SDK/livox_ros_driver2 (lddc.cpp), RoboSense-LiDAR/rslidar_sdk
// (source_pointcloud_ros.hpp), velodyne_gazebo_plugins, gz-sensors (GpuLidarSensor.cc),
// carla-simulator/ros-bridge (lidar.py) and Isaac Sim's ROS1PublishPointCloud. A `label` behind their fields
// is what a network adds.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <optional>

#include "bki_mapping/settings/yaml.h"
#include "ros/point_field.h"
#include "ros/pose_conversion.h"
#include "ros/scan_reader.h"

namespace bki_mapping::ros_interface {
namespace {

using sensor_msgs::PointField;

constexpr double kStamp = 1.7e9, kSpeed = 10.0, kScan = 0.1;
constexpr std::size_t kRings = 16, kColumns = 360;
constexpr double kPi = 3.14159265358979323846, kStep = 2.0 * kPi / kColumns;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Field {
  std::string name;
  std::uint8_t datatype;
  std::uint32_t offset;
};

/// A cloud of a layout, whose values are set one by one.
class Layout {
 public:
  Layout(const std::vector<Field>& fields, std::uint32_t point_step, std::size_t height, std::size_t width) {
    cloud.header.frame_id = "lidar";
    cloud.is_bigendian = hostIsBigEndian();
    cloud.height = static_cast<std::uint32_t>(height);
    cloud.width = static_cast<std::uint32_t>(width);
    cloud.point_step = point_step;
    cloud.row_step = point_step * cloud.width;
    cloud.data.resize(std::size_t{cloud.row_step} * height);
    for (const Field& f : fields) {
      PointField field;
      field.name = f.name;
      field.datatype = f.datatype;
      field.offset = f.offset;
      field.count = 1;
      cloud.fields.push_back(field);
    }
  }

  void set(std::size_t point, const std::string& name, double value) {
    for (const PointField& field : cloud.fields) {
      if (field.name != name) continue;
      std::uint8_t* bytes = cloud.data.data() + point * cloud.point_step + field.offset;
      if (field.datatype == PointField::UINT8) return store(static_cast<std::uint8_t>(value), bytes);
      if (field.datatype == PointField::UINT16) return store(static_cast<std::uint16_t>(value), bytes);
      if (field.datatype == PointField::UINT32) return store(static_cast<std::uint32_t>(value), bytes);
      if (field.datatype == PointField::FLOAT32) return store(static_cast<float>(value), bytes);
      if (field.datatype == PointField::FLOAT64) return store(value, bytes);
    }
    ADD_FAILURE() << "no field " << name;
  }
  void set(std::size_t point, const Eigen::Vector3f& place) {
    for (int axis = 0; axis < 3; ++axis) {
      set(point, std::string(1, static_cast<char>('x' + axis)), static_cast<double>(place[axis]));
    }
  }

  sensor_msgs::PointCloud2 cloud;

 private:
  template <typename T>
  static void store(T value, std::uint8_t* bytes) {
    std::memcpy(bytes, &value, sizeof(T));
  }
};

std::vector<Field> with(std::vector<Field> fields, const std::vector<Field>& more) {
  fields.insert(fields.end(), more.begin(), more.end());
  return fields;
}
const std::vector<Field> kXyz = {
    {"x", PointField::FLOAT32, 0}, {"y", PointField::FLOAT32, 4}, {"z", PointField::FLOAT32, 8}};

/// A beam of the lidar: a column is fired at once, from left to right.
struct Beam {
  std::size_t ring, column;
  double time;  ///< after the start of the scan [s]
  Eigen::Vector3d direction;
};

Beam beamAt(std::size_t ring, std::size_t column) {
  const double azimuth = kStep * static_cast<double>(column);
  const double elevation = (-15.0 + 2.0 * static_cast<double>(ring)) * kPi / 180.0;
  return {ring,
          column,
          kScan * static_cast<double>(column) / kColumns,
          {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
           std::sin(elevation)}};
}

/// Where a beam from the sensor ends in a hall without a roof: on the ground (40) or a wall (50) below 3 m.
struct Hit {
  Eigen::Vector3d place;  ///< relative to the sensor [m]
  std::uint32_t label;
};
std::optional<Hit> hitOf(const Beam& beam, double sensor_x) {
  constexpr double kGround = -1.7, kTop = 3.0, kWall = 15.0;
  double range = std::numeric_limits<double>::infinity();
  std::uint32_t label = 0;
  const auto meet = [&](double distance, std::uint32_t what) {
    if (distance > 0.0 && distance < range) {
      range = distance;
      label = what;
    }
  };
  meet(kGround / beam.direction.z(), 40);
  for (const double side : {-kWall, kWall}) {
    meet((side - sensor_x) / beam.direction.x(), 50);
    meet(side / beam.direction.y(), 50);
  }
  if (range * beam.direction.z() > kTop) return std::nullopt;
  return Hit{range * beam.direction, label};
}

class DriverLayouts : public testing::Test {
 protected:
  DriverLayouts() { input_.sensor_model.max_range = 60.0; }

  /// The scan of a cloud. The sensor drives forwards, and is at x = 0 when the scan begins.
  PlacedScan read(const sensor_msgs::PointCloud2& cloud, double start,
                  const std::string& table = "semantic_kitti") {
    PoseSource poses;
    for (double t = -0.5; t < 0.55; t += 0.05) {
      geometry_msgs::TransformStamped pose;
      pose.header.frame_id = "map";
      pose.header.stamp = ros::Time(start + t);
      pose.child_frame_id = "lidar";
      pose.transform.translation.x = kSpeed * t;
      pose.transform.rotation.w = 1.0;
      poses.add(pose);
    }
    classes_ = std::make_unique<ClassTable>(loadClassTable(table));
    const ScanReader reader(input_, "map", *classes_, LabelValues::kRaw);
    EXPECT_TRUE(reader.ready(cloud, poses));
    return std::get<PlacedScan>(reader.read(cloud, poses));
  }

  /// All points are on the ground or the walls, and are labelled so.
  static void expectHall(const PlacedScan& placed, std::size_t hits, bool labelled = true) {
    const Scan& scan = placed.scan;
    ASSERT_EQ(scan.labels.size(), scan.points.size());
    std::size_t found = 0;
    for (std::size_t n = 0; n < scan.points.size(); ++n) {
      if (!needsTime(scan.points[n]) || scan.points[n].norm() < 0.001f) continue;
      const Eigen::Vector3d place = scan.origin + scan.points[n].cast<double>();
      ++found;
      const double off_ground = std::abs(place.z() + 1.7);
      const double off_wall =
          std::min(std::abs(std::abs(place.x()) - 15.0), std::abs(std::abs(place.y()) - 15.0));
      ASSERT_LT(std::min(off_ground, off_wall), 0.006) << n << ": " << place.transpose();
      if (labelled) {
        ASSERT_EQ(scan.labels[n], off_ground < off_wall ? 40u : 50u) << place.transpose();
      }
    }
    EXPECT_EQ(found, hits);
    EXPECT_TRUE(placed.unlisted_labels.empty() || !labelled);
  }

  /// The directions of beams without a return, where the returns tell them, are right to half the spacing of
  /// beams. @param holes by place in the cloud.
  static void expectHoles(const PlacedScan& placed, const std::map<std::size_t, Beam>& holes) {
    const std::vector<Eigen::Vector3f>& found = placed.scan.no_returns;
    ASSERT_EQ(found.size(), holes.size());
    std::size_t known = 0, n = 0;
    for (const auto& [place, beam] : holes) {
      const Eigen::Vector3f& direction = found[n++];
      if (direction.isZero()) continue;
      ++known;
      ASSERT_LT((direction.normalized() - beam.direction.cast<float>()).norm(), 0.5 * kStep) << place;
    }
    EXPECT_GT(known, 100u);
  }

  InputConfig input_;
  std::unique_ptr<ClassTable> classes_;
};

/// The beams in the order of firing.
std::vector<Beam> fired() {
  std::vector<Beam> beams;
  for (std::size_t column = 0; column < kColumns; ++column) {
    for (std::size_t ring = 0; ring < kRings; ++ring) beams.push_back(beamAt(ring, column));
  }
  return beams;
}

/// Where the sensor is when a beam is fired.
double moving(const Beam& beam) {
  return kSpeed * beam.time;
}
double standing(const Beam&) {
  return 0.0;
}

/// The beams with a return, in the order of firing.
std::vector<std::pair<Beam, Hit>> returnsOf(double (*sensorAt)(const Beam&)) {
  std::vector<std::pair<Beam, Hit>> returns;
  for (const Beam& beam : fired()) {
    if (const auto hit = hitOf(beam, sensorAt(beam))) returns.emplace_back(beam, *hit);
  }
  return returns;
}

/// An unorganised cloud of the beams with a return.
Layout listed(const std::vector<Field>& fields, std::uint32_t point_step,
              const std::vector<std::pair<Beam, Hit>>& returns, const std::string& label = "label") {
  Layout layout(fields, point_step, 1, returns.size());
  for (std::size_t n = 0; n < returns.size(); ++n) {
    layout.set(n, returns[n].second.place.cast<float>());
    if (!label.empty()) layout.set(n, label, returns[n].second.label);
  }
  return layout;
}

/// An organised cloud.
struct Organised {
  Layout layout;
  std::vector<std::pair<std::size_t, Beam>> points;  ///< places of all beams, in the order of firing
  std::size_t hits = 0;
  std::map<std::size_t, Beam> holes;  ///< places of beams without a return
};
enum class Rows { kAreRings, kAreFirings };
/// @param missing what the coordinates of a beam without a return are.
Organised organised(const std::vector<Field>& fields, std::uint32_t point_step, Rows rows,
                    double (*sensorAt)(const Beam&), Eigen::Vector3f (*missing)(const Beam&)) {
  const bool rings = rows == Rows::kAreRings;
  Organised cloud{
      Layout(fields, point_step, rings ? kRings : kColumns, rings ? kColumns : kRings), {}, 0, {}};
  for (const Beam& beam : fired()) {
    const std::size_t n = rings ? beam.ring * kColumns + beam.column : beam.column * kRings + beam.ring;
    const auto hit = hitOf(beam, sensorAt(beam));
    cloud.points.emplace_back(n, beam);
    cloud.hits += hit ? 1 : 0;
    if (!hit) cloud.holes.emplace(n, beam);
    cloud.layout.set(n, hit ? Eigen::Vector3f(hit->place.cast<float>()) : missing(beam));
    cloud.layout.set(n, "label", hit ? hit->label : 0);
  }
  return cloud;
}
Eigen::Vector3f notANumber(const Beam&) {
  return Eigen::Vector3f::Constant(kNan);
}
Eigen::Vector3f zero(const Beam&) {
  return Eigen::Vector3f::Zero();
}
Eigen::Vector3f infiniteAlong(const Beam& beam) {
  return beam.direction.cast<float>() * std::numeric_limits<float>::infinity();
}

const std::vector<Field> kVelodyne = with(kXyz, {{"intensity", PointField::FLOAT32, 12},
                                                 {"ring", PointField::UINT16, 16},
                                                 {"time", PointField::FLOAT32, 18},
                                                 {"label", PointField::UINT32, 22}});

TEST_F(DriverLayouts, Velodyne) {
  // Points in the order of firing, beams without a return left out. The stamp is that of the last packet, so
  // times are negative.
  const auto hits = returnsOf(moving);
  Layout layout = listed(kVelodyne, 26, hits);
  for (std::size_t n = 0; n < hits.size(); ++n) {
    layout.set(n, "time", hits[n].first.time - kScan);
    layout.set(n, "ring", static_cast<double>(hits[n].first.ring));
  }
  layout.cloud.header.stamp = ros::Time(kStamp + kScan);
  input_.time_field = "time";
  const PlacedScan scan = read(layout.cloud, kStamp);
  EXPECT_EQ(scan.times, "in s after the stamp");
  EXPECT_NEAR(scan.scan.origin.x(), kSpeed * kScan, 1e-6);
  expectHall(scan, hits.size());
}

TEST_F(DriverLayouts, VelodyneOrganised) {
  // organize_cloud: a row a firing, a column a ring, NaN without a return.
  Organised cloud = organised(kVelodyne, 26, Rows::kAreFirings, moving, notANumber);
  for (const auto& [n, beam] : cloud.points) cloud.layout.set(n, "time", beam.time - kScan);
  cloud.layout.cloud.header.stamp = ros::Time(kStamp + kScan);
  input_.time_field = "time";
  input_.clear_no_returns = true;
  const PlacedScan scan = read(cloud.layout.cloud, kStamp);
  expectHall(scan, cloud.hits);
  expectHoles(scan, cloud.holes);
}

TEST_F(DriverLayouts, Ouster) {
  // A row a ring, (0, 0, 0) without a return, ns after the first column, aligned as PCL aligns structs.
  const auto fields = with(kXyz, {{"intensity", PointField::FLOAT32, 16},
                                  {"t", PointField::UINT32, 20},
                                  {"reflectivity", PointField::UINT16, 24},
                                  {"ring", PointField::UINT16, 26},
                                  {"ambient", PointField::UINT16, 28},
                                  {"range", PointField::UINT32, 32},
                                  {"label", PointField::UINT16, 36}});
  Organised cloud = organised(fields, 48, Rows::kAreRings, moving, zero);
  for (const auto& [n, beam] : cloud.points) {
    cloud.layout.set(n, "t", 1e9 * beam.time);
    cloud.layout.set(n, "ring", static_cast<double>(beam.ring));
    const auto hit = hitOf(beam, moving(beam));
    if (hit) cloud.layout.set(n, "range", 1e3 * hit->place.norm());
  }
  cloud.layout.cloud.header.stamp = ros::Time(kStamp);
  cloud.layout.cloud.is_dense = true;
  input_.time_field = "t";
  input_.clear_no_returns = true;
  const PlacedScan scan = read(cloud.layout.cloud, kStamp);
  EXPECT_EQ(scan.times, "in ns after the stamp");
  expectHall(scan, cloud.hits);
  expectHoles(scan, cloud.holes);
}

/// Unorganised points without those of no return, with absolute times.
Layout absolute(const std::vector<Field>& fields, std::uint32_t point_step, double unit, bool zeros,
                std::size_t& hits) {
  std::vector<std::pair<Beam, std::optional<Hit>>> points;
  hits = 0;
  for (const Beam& beam : fired()) {
    const auto hit = hitOf(beam, moving(beam));
    hits += hit ? 1 : 0;
    if (hit || zeros) points.emplace_back(beam, hit);
  }
  Layout layout(fields, point_step, 1, points.size());
  for (std::size_t n = 0; n < points.size(); ++n) {
    const auto& [beam, hit] = points[n];
    layout.set(n, "timestamp", unit * (kStamp + beam.time));
    if (!hit) continue;
    layout.set(n, hit->place.cast<float>());
    layout.set(n, "label", hit->label);
  }
  layout.cloud.header.stamp = ros::Time(kStamp);
  return layout;
}

TEST_F(DriverLayouts, Hesai) {
  std::size_t hits = 0;
  const auto fields = with(kXyz, {{"intensity", PointField::FLOAT32, 12},
                                  {"ring", PointField::UINT16, 16},
                                  {"timestamp", PointField::FLOAT64, 18},
                                  {"label", PointField::UINT16, 26}});
  input_.time_field = "timestamp";
  const PlacedScan scan = read(absolute(fields, 28, 1.0, false, hits).cloud, kStamp);
  EXPECT_EQ(scan.times, "in s since 1970");
  expectHall(scan, hits);
}

TEST_F(DriverLayouts, HesaiBefore2023) {
  std::size_t hits = 0;
  const auto fields = with(kXyz, {{"intensity", PointField::FLOAT32, 16},
                                  {"timestamp", PointField::FLOAT64, 24},
                                  {"ring", PointField::UINT16, 32},
                                  {"label", PointField::UINT16, 34}});
  input_.time_field = "timestamp";
  const PlacedScan scan = read(absolute(fields, 48, 1.0, false, hits).cloud, kStamp);
  expectHall(scan, hits);
}

TEST_F(DriverLayouts, Livox) {
  // Not aligned, ns since 1970 as doubles, (0, 0, 0) without a return.
  std::size_t hits = 0;
  const auto fields = with(kXyz, {{"intensity", PointField::FLOAT32, 12},
                                  {"tag", PointField::UINT8, 16},
                                  {"line", PointField::UINT8, 17},
                                  {"timestamp", PointField::FLOAT64, 18},
                                  {"label", PointField::UINT8, 26}});
  input_.time_field = "timestamp";
  const PlacedScan scan = read(absolute(fields, 27, 1e9, true, hits).cloud, kStamp);
  EXPECT_EQ(scan.times, "in ns since 1970");
  expectHall(scan, hits);
}

TEST_F(DriverLayouts, Robosense) {
  // A row a firing, a column a ring, NaN without a return; the stamp is that of the last point.
  const auto fields = with(kXyz, {{"intensity", PointField::FLOAT32, 12},
                                  {"ring", PointField::UINT16, 16},
                                  {"timestamp", PointField::FLOAT64, 18},
                                  {"label", PointField::UINT16, 26}});
  Organised cloud = organised(fields, 28, Rows::kAreFirings, moving, notANumber);
  for (const auto& [n, beam] : cloud.points) cloud.layout.set(n, "timestamp", kStamp + beam.time);
  cloud.layout.cloud.header.stamp = ros::Time(kStamp + kScan);
  input_.time_field = "timestamp";
  input_.clear_no_returns = true;
  const PlacedScan scan = read(cloud.layout.cloud, kStamp);
  EXPECT_EQ(scan.times, "in s since 1970");
  EXPECT_NEAR(scan.scan.origin.x(), kSpeed * kScan, 1e-6);
  expectHall(scan, cloud.hits);
  expectHoles(scan, cloud.holes);
}

TEST_F(DriverLayouts, GazeboVelodynePlugin) {
  // All beams at one time, which is simulated; `time` is 0. NaN are left out without organize_cloud.
  const auto hits = returnsOf(standing);
  Layout layout = listed(kVelodyne, 26, hits);
  layout.cloud.header.stamp = ros::Time(12.0);
  expectHall(read(layout.cloud, 12.0), hits.size());
  input_.time_field = "time";  // not needed, and no harm
  expectHall(read(layout.cloud, 12.0), hits.size());
}

TEST_F(DriverLayouts, GazeboGpuLidar) {
  // gz sim through ros_gz_bridge: a row a ring, infinity times the direction without a return.
  const auto fields = with(kXyz, {{"intensity", PointField::FLOAT32, 16},
                                  {"ring", PointField::UINT16, 20},
                                  {"label", PointField::UINT32, 24}});
  Organised cloud = organised(fields, 32, Rows::kAreRings, standing, infiniteAlong);
  cloud.layout.cloud.header.stamp = ros::Time(12.0);
  input_.clear_no_returns = true;
  const PlacedScan scan = read(cloud.layout.cloud, 12.0);
  expectHall(scan, cloud.hits);
  expectHoles(scan, cloud.holes);
}

TEST_F(DriverLayouts, CarlaSemanticLidar) {
  // Unorganised, beams without a return left out, all at one time; the label is ObjTag.
  const auto hits = returnsOf(standing);
  const auto fields = with(kXyz, {{"CosAngle", PointField::FLOAT32, 12},
                                  {"ObjIdx", PointField::UINT32, 16},
                                  {"ObjTag", PointField::UINT32, 20}});
  Layout layout = listed(fields, 24, hits, "");
  const auto tagOf = [](const Hit& hit) { return hit.label == 40 ? 7u : 1u; };  // road, building
  for (std::size_t n = 0; n < hits.size(); ++n) {
    layout.set(n, "ObjIdx", 4711.0);
    layout.set(n, "ObjTag", tagOf(hits[n].second));
  }
  layout.cloud.header.stamp = ros::Time(12.0);
  input_.label_field = "ObjTag";
  const PlacedScan scan = read(layout.cloud, 12.0, "carla");
  expectHall(scan, hits.size(), false);
  EXPECT_TRUE(scan.unlisted_labels.empty());
  for (std::size_t n = 0; n < hits.size(); ++n) ASSERT_EQ(scan.scan.labels[n], tagOf(hits[n].second));
}

TEST_F(DriverLayouts, IsaacSim) {
  // Nothing but coordinates.
  const auto hits = returnsOf(standing);
  Layout layout = listed(kXyz, 12, hits, "");
  layout.cloud.header.stamp = ros::Time(12.0);
  input_.label_field = "";
  expectHall(read(layout.cloud, 12.0, "occupancy"), hits.size(), false);
}

}  // namespace
}  // namespace bki_mapping::ros_interface
