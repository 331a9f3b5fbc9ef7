// That OctoMap gets the same points in the same voxels.
#include "evaluation/octomap_mapper.h"

#include <gtest/gtest.h>

#include <limits>

namespace bki_mapping {
namespace {

TEST(OctomapMapper, HasTheVoxelsOfTheMap) {
  const GridGeometry geometry(0.3);
  OctomapMapper mapper(geometry.resolution());
  Scan scan;
  scan.origin = {0.4, -0.2, 0.1};
  const std::vector<Eigen::Vector3d> hits = {{5.05, 0.1, 0.2}, {-4.1, -3.3, 1.0}, {0.2, 7.7, -0.4}};
  for (const Eigen::Vector3d& hit : hits) scan.points.push_back((hit - scan.origin).cast<float>());
  scan.points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f);
  EXPECT_GE(mapper.integrate(scan), 0.0);
  for (const Eigen::Vector3d& hit : hits) {
    const VoxelIndex voxel = geometry.voxelAt(hit);
    EXPECT_TRUE(mapper.at(voxel)) << hit.transpose();
    EXPECT_FALSE(mapper.at({voxel.x + 1, voxel.y + 1, voxel.z + 1})) << "unknown";
    EXPECT_FALSE(mapper.at(geometry.voxelAt(0.5 * (hit + scan.origin)))) << "crossed";
  }
  EXPECT_GT(mapper.bytes(), 0u);
}

TEST(OctomapMapper, ClearsWhatItCrossesLongEnough) {
  OctomapMapper mapper(1.0);
  Scan near, far;
  near.points = {{5.5f, 0.5f, 0.5f}};
  far.points = {{9.5f, 0.9f, 0.9f}};
  const VoxelIndex voxel{5, 0, 0};
  for (int n = 0; n < 20; ++n) mapper.integrate(near);
  EXPECT_TRUE(mapper.at(voxel));
  int scans = 0;
  for (; mapper.at(voxel) && scans < 100; ++scans) mapper.integrate(far);
  // From the clamped log-odds of 0.97, 3.476, by steps of that of 0.4, -0.405.
  EXPECT_EQ(scans, 9);
}

}  // namespace
}  // namespace bki_mapping
