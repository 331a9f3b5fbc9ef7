// Cleaned points: those in occupied voxels and no others, as PCL reads them.
#include "export/cleaned_points.h"

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <cstring>
#include <random>

#include "bki_mapping/rules/voxel_state.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

/// Scans all over a map of random blocks, with points that are no numbers or far away.
/// @param place that the sensor starts at.
std::string writeSequence(const TemporaryFolder& folder,
                          const Eigen::Vector3d& place = Eigen::Vector3d::Zero()) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> draw(-8.0f, 8.0f);
  SequenceWriter writer(folder / "sequence");
  for (int s = 0; s < 3; ++s) {
    SequenceFrame frame;
    frame.T_map_sensor.linear() = Eigen::AngleAxisd(s, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    frame.T_map_sensor.translation() = place + Eigen::Vector3d(s, 0.5, -0.1);
    for (int i = 0; i < 2000; ++i) {
      frame.points.emplace_back(draw(random), draw(random), draw(random));
      if (i % 100 == 0) frame.points.back().x() = i % 200 == 0 ? std::nanf("") : 1e30f;
      frame.remissions.push_back(0.001f * static_cast<float>(i));
      frame.labels.push_back(static_cast<std::uint32_t>(i % 300));
    }
    frame.stamp = Sequence::kFirstStamp + static_cast<std::uint64_t>(s) * 100000000;
    writer.write(frame);
  }
  writer.finish();
  return folder / "sequence";
}

TEST(CleanedPoints, LieInOccupiedVoxels) {
  const TemporaryFolder folder;
  const Sequence sequence(writeSequence(folder));
  const SemanticMap map = randomMap(2, 200, 3);
  std::vector<CleanedPoint> expected;
  for (const std::size_t i : {std::size_t{0}, std::size_t{2}}) {
    const SequenceFrame frame = sequence.read(i);
    const Scan scan = frame.scan();
    for (std::size_t p = 0; p < scan.points.size(); ++p) {
      const Eigen::Vector3d point = scan.origin + scan.points[p].cast<double>();
      if (!(point.norm() < 1e6)) continue;
      const VoxelView view = viewPoint(map, StateRules(), point);
      if (view.state != VoxelState::kOccupied) continue;
      expected.push_back({static_cast<float>(point.x()), static_cast<float>(point.y()),
                          static_cast<float>(point.z()), frame.remissions[p], frame.labels[p], view.label});
    }
  }
  std::vector<std::size_t> told;
  const CleanedCount count =
      writeCleanedPoints(folder / "points.pcd", sequence, {0, 2}, map, StateRules(), [&](std::size_t n) {
        told.push_back(n);
        return true;
      });
  EXPECT_EQ(count.points, 4000u);
  EXPECT_EQ(count.kept, expected.size());
  EXPECT_EQ(told, (std::vector<std::size_t>{1, 2}));
  ASSERT_GT(expected.size(), 200u);
  ASSERT_LT(expected.size(), 3000u);

  pcl::PCLPointCloud2 cloud;
  ASSERT_EQ(pcl::PCDReader().read(folder / "points.pcd", cloud), 0);
  ASSERT_EQ(cloud.width, expected.size());
  ASSERT_EQ(cloud.point_step, sizeof(CleanedPoint));
  ASSERT_EQ(cloud.data.size(), expected.size() * sizeof(CleanedPoint));
  EXPECT_EQ(std::memcmp(cloud.data.data(), expected.data(), cloud.data.size()), 0);
  pcl::PointCloud<pcl::PointXYZL> labelled;
  pcl::fromPCLPointCloud2(cloud, labelled);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(labelled[i].x, float{expected[i].x});
    ASSERT_EQ(labelled[i].label, std::uint32_t{expected[i].label});
  }
}

TEST(CleanedPoints, AreRelativeToTheViewpointFarFromTheOrigin) {
  const TemporaryFolder folder;
  const GridIndex blocks{208000, 1666000, 0};  // a place in UTM coordinates
  const Eigen::Vector3d place = 2.4 * Eigen::Vector3d(blocks.x, blocks.y, blocks.z);
  const std::string written = writeSequence(folder, place);
  SequenceOptions options;
  options.map_poses = written + "/poses.txt";
  const Sequence sequence(written, options);
  const SemanticMap near = randomMap(2, 200, 3);
  SemanticMap map = infoOf().emptyMap();
  for (const auto& [index, block] : near.entries()) {
    map.getOrAllocate({{index.x + blocks.x, index.y + blocks.y, index.z + blocks.z}}) = *block;
  }
  std::vector<Eigen::Vector3d> expected;
  const Scan scan = sequence.read(0).scan();
  for (const Eigen::Vector3f& relative : scan.points) {
    const Eigen::Vector3d point = scan.origin + relative.cast<double>();
    if (!((point - place).norm() < 1e6)) continue;
    if (viewPoint(map, StateRules(), point).state == VoxelState::kOccupied) expected.push_back(point);
  }
  writeCleanedPoints(folder / "points.pcd", sequence, {0}, map, StateRules());
  pcl::PointCloud<pcl::PointXYZL> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(folder / "points.pcd", cloud), 0);
  EXPECT_EQ(cloud.sensor_origin_.head<3>(), Eigen::Vector3f(499000.0f, 3998000.0f, 0.0f));
  ASSERT_GT(expected.size(), 100u);
  ASSERT_EQ(cloud.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Eigen::Vector3d point =
        cloud.sensor_origin_.head<3>().cast<double>() + cloud[i].getVector3fMap().cast<double>();
    ASSERT_LT((point - expected[i]).norm(), 1e-3) << i;
  }
}

TEST(CleanedPoints, MayBeNone) {
  const TemporaryFolder folder;
  const Sequence sequence(writeSequence(folder));
  EXPECT_EQ(writeCleanedPoints(folder / "points.pcd", sequence, {0}, infoOf().emptyMap(), StateRules()).kept,
            0u);
  EXPECT_GT(std::filesystem::file_size(folder / "points.pcd"), 100u);
  EXPECT_THROW(writeCleanedPoints(folder / "points.ply", sequence, {0}, infoOf().emptyMap(), StateRules()),
               std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
