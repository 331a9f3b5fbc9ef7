// Clouds of every make are read right, and wrong ones refused in one sentence.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

#include "bki_mapping/ros/cloud_conversion.h"
#include "bki_mapping/ros/pose_conversion.h"

namespace bki_mapping::ros_shell {
namespace {

using sensor_msgs::PointField;

sensor_msgs::PointCloud2 twoPoints() {
  return makeCloud({{1, 2, 3}, {4, 5, 6}}, {0.5f, 0.25f}, {40, 252});
}

std::string faultOf(const sensor_msgs::PointCloud2& cloud, const std::string& field = "label") {
  try {
    readCloud(cloud, field);
  } catch (const std::invalid_argument& fault) {
    return fault.what();
  }
  return "";
}

TEST(Cloud, IsReadAsItWasMade) {
  const CloudContent content = readCloud(twoPoints(), "label");
  EXPECT_EQ(content.points, (std::vector<Eigen::Vector3f>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(content.labels, (std::vector<std::uint32_t>{40, 252}));
  EXPECT_EQ(readCloud(twoPoints(), "").labels, (std::vector<std::uint32_t>{0, 0}));
}

TEST(Cloud, FloatLabelsAreRoundedAndNonsenseIsNoLabel) {
  sensor_msgs::PointCloud2 cloud = twoPoints();
  cloud.fields[4].datatype = PointField::FLOAT32;
  for (const auto& [value, label] : std::vector<std::pair<float, std::uint32_t>>{
           {40.0f, 40u}, {39.9f, 40u}, {-1.0f, 0xffffffffu}, {NAN, 0xffffffffu}, {1e20f, 0xffffffffu}}) {
    std::memcpy(cloud.data.data() + 16, &value, 4);
    EXPECT_EQ(readCloud(cloud, "label").labels[0], label) << value;
  }
}

TEST(Cloud, RowsMayBePadded) {
  sensor_msgs::PointCloud2 cloud = twoPoints();
  cloud.height = 2;
  cloud.width = 1;
  cloud.row_step = 32;
  std::vector<std::uint8_t> padded(52, 0xee);
  std::memcpy(padded.data(), cloud.data.data(), 20);
  std::memcpy(padded.data() + 32, cloud.data.data() + 20, 20);
  cloud.data = padded;
  EXPECT_EQ(readCloud(cloud, "label").labels, (std::vector<std::uint32_t>{40, 252}));
}

TEST(Cloud, RefusesWhatDoesNotFit) {
  sensor_msgs::PointCloud2 cloud = twoPoints();
  EXPECT_NE(faultOf(cloud, "class").find("no field 'class' (it has: x, y, z, intensity, label)"),
            std::string::npos);
  cloud.data.pop_back();
  EXPECT_NE(faultOf(cloud).find("40 bytes of points, but holds 39"), std::string::npos);
  cloud = twoPoints();
  cloud.width = 0xffffffffu;
  cloud.height = 0xffffffffu;
  EXPECT_NE(faultOf(cloud), "");
  cloud = twoPoints();
  cloud.fields[4].offset = 18;
  EXPECT_NE(faultOf(cloud).find("beyond its point_step 20"), std::string::npos);
  cloud.fields[4].offset = 0xfffffffeu;
  EXPECT_NE(faultOf(cloud), "");
  cloud = twoPoints();
  cloud.fields[0].datatype = 77;
  EXPECT_NE(faultOf(cloud).find("unknown datatype 77"), std::string::npos);
  cloud = twoPoints();
  cloud.point_step = 0;
  EXPECT_NE(faultOf(cloud), "");
  cloud.data.clear();
  EXPECT_NE(faultOf(cloud), "");
}

TEST(Pose, SurvivesTheTripThroughAMessage) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(Eigen::Vector3d(1, -2, 3))
      .rotate(Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 2, 3).normalized()));
  EXPECT_TRUE(toIsometry(toTransform(T)).isApprox(T, 1e-12));
}

}  // namespace
}  // namespace bki_mapping::ros_shell
