// PCD files: every encoding reads alike, and every fault is named before memory is taken.
#include "sequence/pcd_file.h"

#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <cmath>
#include <fstream>

#include "refusal_of.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

const char kHeader[] =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n";
const char kViewpoint[] = "VIEWPOINT 10 -20 0.5 0.5 0.5 0.5 0.5\n";

class PcdFile : public testing::Test {
 protected:
  std::string write(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return path_;
  }
  template <typename Read>
  void expectFault(const std::string& words, Read&& read) {
    const std::string text = refusalOf<std::runtime_error>([&] { read(path_); });
    EXPECT_NE(text.find(words), std::string::npos) << "'" << text << "' should be: " << words;
    EXPECT_EQ(text.find(path_), 0u) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
  void expectFault(const std::string& words) { expectFault(words, readPcdPoints); }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "cloud.pcd";
};

TEST_F(PcdFile, EncodingsReadAlike) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  for (int i = 0; i < 1000; ++i) {
    cloud.emplace_back(0.25f * static_cast<float>(i), -1.5f, static_cast<float>(i % 7),
                       static_cast<float>(i % 2));
  }
  cloud[3].x = std::nanf("");
  cloud.is_dense = false;
  const auto check = [&](const char* what) {
    const PcdPoints read = readPcdPoints(path_);
    ASSERT_EQ(read.points.size(), cloud.size()) << what;
    ASSERT_EQ(read.intensity.size(), cloud.size()) << what;
    EXPECT_TRUE(read.label.empty());
    EXPECT_FALSE(read.points[3].allFinite());
    for (std::size_t i = 4; i < cloud.size(); ++i) {
      ASSERT_EQ(read.points[i].cast<float>(), cloud[i].getVector3fMap()) << what << " " << i;
      ASSERT_EQ(read.intensity[i], double{cloud[i].intensity});
    }
  };
  ASSERT_EQ(pcl::io::savePCDFileASCII(path_, cloud), 0);
  check("ASCII");
  ASSERT_EQ(pcl::io::savePCDFileBinary(path_, cloud), 0);
  check("binary");
  ASSERT_EQ(pcl::io::savePCDFileBinaryCompressed(path_, cloud), 0);
  check("compressed");
}

TEST_F(PcdFile, ReadsWhatWasWritten) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(1234.567891, -0.1, 3.0);
  writePcdPoints(path_, {{1, 2, 3}, {4, 5, 6.5f}}, Eigen::Vector3d::Zero(), {0, 1}, pose);
  const PcdPoints read = readPcdPoints(path_);
  EXPECT_EQ(read.points, (std::vector<Eigen::Vector3d>{{1, 2, 3}, {4, 5, 6.5f}}));
  EXPECT_EQ(read.intensity, (std::vector<double>{0, 1}));
  EXPECT_TRUE(readPcdViewpoint(path_).isApprox(pose, 1e-12));
  pcl::PCLPointCloud2 cloud;
  ASSERT_EQ(pcl::PCDReader().read(path_, cloud), 0) << "PCL reads it, too";
  EXPECT_EQ(cloud.width, 2u);
}

TEST_F(PcdFile, DoublesAreReadAndWrittenFarFromTheOrigin) {
  const Eigen::Vector3d origin(500000.0, 4000000.0, 0.0);
  writePcdPoints(path_, {{0.0625f, -2.125f, 3.0f}}, origin, {0.5f}, Eigen::Isometry3d::Identity());
  const PcdPoints read = readPcdPoints(path_);
  EXPECT_EQ(read.points, (std::vector<Eigen::Vector3d>{{500000.0625, 3999997.875, 3.0}}));
  EXPECT_EQ(read.intensity, (std::vector<double>{0.5}));
}

TEST_F(PcdFile, OtherTypesAndFieldsAreTaken) {
  write(
      "FIELDS label x y z\nSIZE 2 8 8 8\nTYPE U F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n252 1 2 3\n");
  const PcdPoints read = readPcdPoints(path_);
  EXPECT_EQ(read.label, std::vector<double>{252});
  EXPECT_EQ(read.points, (std::vector<Eigen::Vector3d>{{1, 2, 3}}));
}

TEST_F(PcdFile, ThePoseIsThatOfTheViewpoint) {
  write(std::string(kHeader) + "WIDTH 0\nHEIGHT 1\n" + kViewpoint + "POINTS 0\nDATA binary\n");
  const Eigen::Isometry3d pose = readPcdViewpoint(path_);
  EXPECT_TRUE((pose * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(10, -19, 0.5), 1e-12));
  EXPECT_TRUE(readPcdPoints(path_).points.empty());
}

TEST_F(PcdFile, NamesFaultsOfThePose) {
  write(std::string(kHeader) + "POINTS 0\nDATA binary\n");
  expectFault("has no line VIEWPOINT with 7 numbers", readPcdViewpoint);
  write(std::string(kHeader) + "VIEWPOINT 0 0 0 1 0 0\nPOINTS 0\nDATA binary\n");
  expectFault("has no line VIEWPOINT with 7 numbers", readPcdViewpoint);
  write(std::string(kHeader) + "VIEWPOINT 0 0 0 nan 0 0 0\nPOINTS 0\nDATA binary\n");
  expectFault("has 'nan' in line VIEWPOINT", readPcdViewpoint);
  write(std::string(kHeader) + "VIEWPOINT 0 0 0 0 0 0 0\nPOINTS 0\nDATA binary\n");
  expectFault("quaternion has length 0.0", readPcdViewpoint);
}

TEST_F(PcdFile, NamesFaultsOfFiles) {
  expectFault("cannot be read");
  write("ply\nformat ascii 1.0\n");
  expectFault("is no PCD file");
  write(std::string(kHeader) + "DATA binary\n");
  expectFault("incomplete header");
  write(std::string(kHeader) + "POINTS many\nDATA binary\n");
  expectFault("has 'many' in line POINTS");
  write("FIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2\n");
  expectFault("lacks one of the fields");
}

TEST_F(PcdFile, BelievesNoCountThatTheFileCannotHold) {
  for (const char* data : {"ascii", "binary", "binary_compressed"}) {
    write(std::string(kHeader) + "WIDTH 200000000\nHEIGHT 1\nPOINTS 200000000\nDATA " + data + "\n" +
          std::string(64, '1'));
    expectFault("too few bytes for the 200000000 points");
  }
  // 2 points, packed into 8 bytes that unpack to another size.
  write(std::string(kHeader) + "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary_compressed\n" +
        std::string("\x08\0\0\0\xff\xff\xff\x7f", 8) + std::string(8, 'x'));
  expectFault("compressed data of another size");
}

}  // namespace
}  // namespace bki_mapping
