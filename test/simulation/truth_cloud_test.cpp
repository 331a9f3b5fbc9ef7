// Files of clouds whose moving points are known, in the layout of the DynamicMap benchmark.
#include "simulation/truth_cloud.h"

#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>
#include <utility>

#include "refusal_of.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

TEST(TruthCloud, HoldsZerosAndOnes) {
  const TemporaryFolder folder;
  const std::string path = folder / "gt_cloud.pcd";
  writeTruthCloud(path, {{{1, 2, 3}, {4, 5, 6}}, {1, 0}});
  const TruthCloud read = readTruthCloud(path);
  EXPECT_EQ(read.points, (std::vector<Eigen::Vector3f>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(read.moving, (std::vector<std::uint8_t>{1, 0}));
  const auto write = [&](const std::string& field, const std::string& rows, int count) {
    std::ofstream(path) << "VERSION 0.7\nFIELDS x y z " << field
                        << "\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH " << count
                        << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << count << "\nDATA ascii\n"
                        << rows;
  };
  const auto fault = [&] { return refusalOf<std::runtime_error>([&] { readTruthCloud(path); }); };
  write("label", "1 2 3 1\nnan 0 0 0\n", 2);
  EXPECT_EQ(readTruthCloud(path).moving, std::vector<std::uint8_t>{1});
  EXPECT_EQ(readTruthCloud(path).not_finite, 1u);
  write("intensity", "1 2 3 1\n1 1 1 0.5\n", 2);
  EXPECT_NE(fault().find("point 1 has intensity 0.5, but must have 1 (moving) or 0"), std::string::npos)
      << fault();
  write("curvature", "1 2 3 1\n", 1);
  EXPECT_NE(fault().find("neither a field label nor a field intensity"), std::string::npos) << fault();
}

TEST(TruthCloud, IsExactFarFromTheOrigin) {
  Scan scan;
  scan.origin = Eigen::Vector3d(500000.3, 4000000.4, 30.0);
  scan.points = {{10.0f, 0.0f, 0.0f}, {10.1f, 0.0f, 0.0f}};
  scan.labels = {252, 40};
  TruthCloud cloud;
  cloud.add(scan);
  const TemporaryFolder folder;
  writeTruthCloud(folder / "gt_cloud.pcd", cloud);
  const TruthCloud read = readTruthCloud(folder / "gt_cloud.pcd");
  for (const TruthCloud* each : {&std::as_const(cloud), &read}) {
    ASSERT_EQ(each->points.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      const Eigen::Vector3d place = each->origin() + each->points[i].cast<double>(),
                            expected = scan.origin + scan.points[i].cast<double>();
      EXPECT_LT((place - expected).norm(), 1e-4) << i;
      EXPECT_EQ(each->relative(scan, i), each->points[i]) << i;
    }
  }
}

TEST(TruthCloud, TakesLabelsWithInstances) {
  constexpr std::uint32_t kInstance = 9u << 16;
  Scan scan;
  scan.points = {{2, 0, 0}, {10, 0, 0}, {10, 1, 0}, {10, 2, 0}};
  scan.labels = {kInstance | 1u, kInstance | 252u, kInstance | 10u, 259u};
  TruthCloud cloud;
  cloud.add(scan);
  EXPECT_EQ(cloud.moving, (std::vector<std::uint8_t>{1, 1, 0, 1}));
  EXPECT_TRUE(KittiLabels::moving().contains(kInstance | 255u));
  EXPECT_FALSE(KittiLabels::moving().contains(kInstance | 251u));
}

}  // namespace
}  // namespace bki_mapping
