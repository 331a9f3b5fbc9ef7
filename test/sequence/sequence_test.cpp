// Sequences: reading returns what was written, and every fault is named.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "bki_mapping/sequence/sequence.h"
#include "refusal_of.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

SequenceFrame frameAt(double x, std::uint64_t stamp) {
  SequenceFrame frame;
  frame.points = {{1.0f, 2.0f, 3.0f}, {-4.0f, 5.5f, 0.25f}};
  frame.remissions = {0.1f, 0.9f};
  frame.labels = {40, 252};
  frame.T_map_sensor.translation() = Eigen::Vector3d(x, 0.1 * x, 0.0);
  frame.T_map_sensor.linear() = Eigen::AngleAxisd(0.1 * x, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  frame.stamp = Sequence::kFirstStamp + stamp;
  return frame;
}

class SequenceFolder : public testing::Test {
 protected:
  void SetUp() override {
    SequenceWriter writer(folder_ / "drive");
    writer.write(frameAt(0.0, 0));
    writer.write(frameAt(1.0, 100000000));
    writer.finish();
  }
  void replace(const std::string& file, const std::string& text) {
    std::ofstream(folder_ / ("drive/" + file), std::ios::binary) << text;
  }
  void expectFault(const std::string& words) {
    const std::string text = refusalOf<std::runtime_error>([&] {
      const Sequence sequence(folder_ / "drive");
      for (std::size_t i = 0; i < sequence.size(); ++i) sequence.read(i);
    });
    EXPECT_NE(text.find(words), std::string::npos) << "'" << text << "' should be: " << words;
  }

  TemporaryFolder folder_;
};

TEST_F(SequenceFolder, ReadsWhatWasWritten) {
  const Sequence sequence(folder_ / "drive");
  ASSERT_EQ(sequence.size(), 2u);
  const SequenceFrame frame = sequence.read(1), expected = frameAt(1.0, 100000000);
  EXPECT_EQ(frame.points, expected.points);
  EXPECT_EQ(frame.labels, expected.labels);
  EXPECT_EQ(frame.remissions, expected.remissions);
  EXPECT_EQ(frame.stamp, expected.stamp);
  EXPECT_TRUE(frame.T_map_sensor.isApprox(expected.T_map_sensor, 1e-12));
  EXPECT_EQ(sequence.name(1), "000001");
}

TEST_F(SequenceFolder, TheMapFrameIsTheFirstSensorFrame) {
  // Poses are those of the camera. Tr transforms sensor axes (x forward) to camera axes (z forward), with an
  // offset.
  replace("calib.txt", "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3\n");
  replace("poses.txt", "1 0 0 7 0 1 0 0 0 0 1 0\n1 0 0 7 0 1 0 0 0 0 1 5\n");
  const Sequence sequence(folder_ / "drive");
  EXPECT_TRUE(sequence.read(0).T_map_sensor.isApprox(Eigen::Isometry3d::Identity(), 1e-12));
  EXPECT_TRUE(sequence.read(1).T_map_sensor.translation().isApprox(Eigen::Vector3d(5, 0, 0), 1e-12));
}

TEST_F(SequenceFolder, PosesOfAnotherFileAreInTheMapFrame) {
  replace("calib.txt", "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
  replace("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 5\n");
  replace("city.txt", "1 0 0 -2 0 1 0 -3 0 0 1 7\n1 0 0 -2 0 1 0 -3 0 0 1 9\n");
  SequenceOptions options;
  options.map_poses = folder_ / "drive/city.txt";
  const Sequence sequence(folder_ / "drive", options);
  EXPECT_TRUE(sequence.pose(0).translation().isApprox(Eigen::Vector3d(7, 2, 3), 1e-12));
  EXPECT_TRUE(sequence.pose(1).translation().isApprox(Eigen::Vector3d(9, 2, 3), 1e-12));
  EXPECT_TRUE(sequence.read(1).T_map_sensor.isApprox(sequence.pose(1)));
}

TEST_F(SequenceFolder, FormatsOfPosesAreRecognised) {
  replace("calib.txt", "Tr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3\n");
  const auto expectPose = [&](const std::string& poses, std::optional<PosesIn> poses_in,
                              const Eigen::Vector3d& expected) {
    replace("poses.txt", poses);
    SequenceOptions options;
    options.poses_in = poses_in;
    const Sequence sequence(folder_ / "drive", options);
    EXPECT_TRUE(sequence.pose(0).isApprox(Eigen::Isometry3d::Identity(), 1e-12)) << poses;
    const Eigen::Vector3d found = sequence.pose(1).translation();
    EXPECT_TRUE(found.isApprox(expected, 1e-12)) << poses << found.transpose();
  };
  const Eigen::Vector3d right(0, -5, 0), ahead(5, 0, 0);  // x of the camera is right, of the lidar ahead
  const std::string rows12 = "1 0 0 7 0 1 0 0 0 0 1 0\n1 0 0 12 0 1 0 0 0 0 1 0\n",
                    rows16 = "1 0 0 7 0 1 0 0 0 0 1 0 0 0 0 1\n1 0 0 12 0 1 0 0 0 0 1 0 0 0 0 1\n",
                    stamped = "# seconds x y z qx qy qz qw\n0 7 0 0 0 0 0 1\n0.1 12 0 0 0 0 0 1\n";
  for (const std::string& rows : {rows12, rows16}) {
    expectPose(rows, std::nullopt, right);
    expectPose(rows, PosesIn::kCamera, right);
    expectPose(rows, PosesIn::kLidar, ahead);
  }
  expectPose(stamped, std::nullopt, ahead);
  expectPose(stamped, PosesIn::kCamera, right);
  // Stamps find the pose, whatever the order and the number of lines.
  expectPose("0 7 0 0 0 0 0 1\n0.2 30 0 0 0 0 0 1\n0.102 12 0 0 0 0 0 1\n0.05 9 0 0 0 0 0 1\n", std::nullopt,
             ahead);
  std::filesystem::remove(folder_ / "drive/calib.txt");
  expectPose(rows12, PosesIn::kLidar, ahead);
  expectFault("say so with --poses-in lidar");
  // Without times of scans, lines belong to scans by their order.
  std::filesystem::remove(folder_ / "drive/times.txt");
  expectPose("100 7 0 0 0 0 0 1\n200 12 0 0 0 0 0 1\n", std::nullopt, ahead);
}

TEST_F(SequenceFolder, ScansNeedNoLabels) {
  std::filesystem::remove_all(folder_ / "drive/labels");
  SequenceOptions options;
  options.labels.clear();
  const Sequence sequence(folder_ / "drive", options);
  EXPECT_FALSE(sequence.labelled());
  EXPECT_EQ(sequence.read(1).labels, (std::vector<std::uint32_t>{0, 0}));
}

TEST_F(SequenceFolder, OnlyScansThatAreAskedForNeedAPose) {
  for (const char* second : {"", "1 0 0 0 0 1\n", "nan 0 0 0 0 1 0 0 0 0 1 0\n"}) {
    replace("poses.txt", std::string("1 0 0 0 0 1 0 0 0 0 1 0\n") + second);
    const Sequence sequence(folder_ / "drive");
    EXPECT_EQ(sequence.size(), 2u);
    EXPECT_EQ(sequence.read(0).points.size(), 2u);
    EXPECT_THROW(sequence.pose(1), std::runtime_error);
    EXPECT_THROW(sequence.read(1), std::runtime_error);
  }
}

TEST_F(SequenceFolder, LabelsKeepTheirInstances) {
  const std::uint32_t labels[] = {40u | 7u << 16, 252u};
  replace("labels/000000.label", std::string(reinterpret_cast<const char*>(labels), sizeof(labels)));
  EXPECT_EQ(Sequence(folder_ / "drive").read(0).labels, (std::vector<std::uint32_t>{40u | 7u << 16, 252u}));
}

TEST_F(SequenceFolder, WithoutTimesScansAreATenthApart) {
  std::filesystem::remove(folder_ / "drive/times.txt");
  EXPECT_EQ(Sequence(folder_ / "drive").read(1).stamp, Sequence::kFirstStamp + 100000000);
}

TEST_F(SequenceFolder, TheLayoutOfTheDynamicMapBenchmarkReadsAlike) {
  SequenceWriter writer(folder_ / "pcd_drive", SequenceLayout::kDynamicMap);
  writer.write(frameAt(0.0, 0));
  writer.write(frameAt(1.0, 250000000));
  writer.finish();
  const SequenceFrame expected = frameAt(1.0, 250000000);
  const auto check = [&](std::uint64_t stamp, const std::vector<std::uint32_t>& labels) {
    const Sequence sequence(folder_ / "pcd_drive");
    ASSERT_EQ(sequence.size(), 2u);
    EXPECT_EQ(sequence.layout(), SequenceLayout::kDynamicMap);
    EXPECT_EQ(sequence.labelled(), labels[0] != 0);
    const SequenceFrame frame = sequence.read(1);
    ASSERT_EQ(frame.points.size(), expected.points.size());
    for (std::size_t i = 0; i < frame.points.size(); ++i)
      EXPECT_TRUE(frame.points[i].isApprox(expected.points[i], 1e-6f)) << frame.points[i].transpose();
    EXPECT_EQ(frame.labels, labels);
    EXPECT_EQ(frame.remissions, expected.remissions);
    EXPECT_EQ(frame.stamp, Sequence::kFirstStamp + stamp);
    EXPECT_TRUE(frame.T_map_sensor.isApprox(expected.T_map_sensor, 1e-12));
  };
  check(250000000, expected.labels);
  std::filesystem::remove(folder_ / "pcd_drive/times.txt");
  std::filesystem::remove_all(folder_ / "pcd_drive/labels");
  check(100000000, {0, 0});
  EXPECT_THROW(Sequence(folder_ / "pcd_drive", {"predictions", "", std::nullopt}), std::runtime_error);
  std::filesystem::rename(folder_ / "pcd_drive/pcd/000001.pcd", folder_ / "pcd_drive/pcd/last.pcd");
  EXPECT_THROW(Sequence(folder_ / "pcd_drive"), std::runtime_error);
}

TEST_F(SequenceFolder, NamesMissingThings) {
  std::filesystem::remove(folder_ / "drive/labels/000001.label");
  expectFault("000001.label cannot be read");
  std::filesystem::remove_all(folder_ / "drive/labels");
  expectFault("labels is not a folder; name one with labels, or say --labels none");
  std::filesystem::create_directory(folder_ / "drive/labels");
  std::filesystem::remove(folder_ / "drive/calib.txt");
  expectFault("calib.txt cannot be read");
  std::filesystem::remove_all(folder_ / "drive/velodyne");
  expectFault("velodyne is not a folder");
}

TEST_F(SequenceFolder, NamesFaultsOfLabelsAndScans) {
  replace("labels/000001.label", "12345678ABCD");
  expectFault("has 3 labels, but");
  replace("labels/000001.label", "123");
  expectFault("not a multiple of 4");
  replace("velodyne/000001.bin", "0123456789");
  expectFault("not a multiple of 16");
}

TEST_F(SequenceFolder, NamesFaultsOfPoses) {
  replace("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  expectFault("poses.txt has no line 2 for scan 000001");
  replace("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1\n");
  expectFault("has 11 numbers, but needs 12");
  replace("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 nan 0 1 0 0 0 0 1 0\n");
  expectFault("'nan' is not a finite number");
  replace("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 0 0 0 0 0 0 0 0 0 0 0\n");
  expectFault("not a rigid transform");
  replace("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n1 0 0 0 0 1 0 0 0 0 1 0 5 0 0 1\n");
  expectFault("poses.txt line 2 is not a rigid transform: the last row of its matrix is not 0 0 0 1");
  replace("poses.txt", "0 0 0 0 0 0 0 1\n#\n0.1 0 0 0 0 0 0 0.5\n");
  expectFault("poses.txt line 3 is not a rigid transform: its quaternion has length 0.5 instead of 1");
  replace("poses.txt", "0 0 0 0 0 0 0 1\n0.1 0 0 0\n");
  expectFault("poses.txt line 2 has no rotation");
  replace("poses.txt", "0 0 0 0 0 0 0 1\n0.3 0 0 0 0 0 0 1\n");
  expectFault(
      "poses.txt has no pose at 0.1 s, the time of scan 000001 in times.txt; the nearest is at 0 s, in line "
      "1");
  replace("poses.txt", "1, 0, 0\n");
  expectFault("poses.txt line 1: '1,' is not a finite number");
  replace("poses.txt", "");
  expectFault("poses.txt has no line 1 for scan 000000");
}

TEST_F(SequenceFolder, NamesFaultsOfCalibrationAndTimes) {
  replace("times.txt", "0\n");
  expectFault("times.txt has no line 2 for scan 000001");
  replace("times.txt", "0\n-1\n");
  expectFault("time must be from 0");
  replace("calib.txt", "Tr: 1 0 0 0 0 1 0 0 0 0 0 0\n");
  expectFault("determinant 0.0");
  replace("calib.txt", "P0: 1 0 0 0\n");
  expectFault("no line 'Tr:'");
}

/// Five scans, 1 m and 0.1 s apart.
class LongerSequence : public SequenceFolder {
 protected:
  void SetUp() override {
    SequenceWriter writer(folder_ / "drive");
    for (int i = 0; i < 5; ++i) writer.write(frameAt(i, static_cast<std::uint64_t>(i) * 100000000));
    writer.finish();
  }
  void remove(const std::string& number) {
    std::filesystem::remove(folder_ / ("drive/velodyne/" + number + ".bin"));
    std::filesystem::remove(folder_ / ("drive/labels/" + number + ".label"));
  }
  void rename(const std::string& from, const std::string& to) {
    for (const auto& [kind, ending] : {std::pair("velodyne/", ".bin"), std::pair("labels/", ".label")}) {
      const std::string start = folder_ / (std::string("drive/") + kind);
      std::filesystem::rename(start + from + ending, start + to + ending);
    }
  }
  /// Expects that every scan has the pose and time of its number.
  void expectPairedByNumber(const std::vector<std::size_t>& numbers) {
    const Sequence sequence(folder_ / "drive");
    ASSERT_EQ(sequence.size(), numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto x = static_cast<double>(numbers[i]);
      EXPECT_EQ(sequence.number(i), numbers[i]);
      EXPECT_NEAR(sequence.read(i).T_map_sensor.translation().x(), x, 1e-9) << sequence.name(i);
      EXPECT_EQ(sequence.read(i).stamp, Sequence::kFirstStamp + numbers[i] * 100000000u) << sequence.name(i);
    }
  }
  std::string gaps() { return Sequence(folder_ / "drive").gaps(); }
};

TEST_F(LongerSequence, PosesAndTimesBelongToTheNumberOfAScan) {
  expectPairedByNumber({0, 1, 2, 3, 4});
  EXPECT_EQ(gaps(), "");
  remove("000001");
  expectPairedByNumber({0, 2, 3, 4});
  EXPECT_EQ(gaps(), "scan 000001 is missing in " + (folder_ / "drive/velodyne"));
  remove("000003");
  expectPairedByNumber({0, 2, 4});
  EXPECT_EQ(gaps(), "scans 000001, 000003 are missing in " + (folder_ / "drive/velodyne"));
  std::filesystem::remove(folder_ / "drive/times.txt");
  expectPairedByNumber({0, 2, 4});
}

TEST_F(LongerSequence, TheMapFrameIsThatOfTheFirstPoseThoughItsScanIsMissing) {
  remove("000000");
  expectPairedByNumber({1, 2, 3, 4});
  EXPECT_EQ(gaps(), "") << "a part of a sequence has no gap before it";
  remove("000002");
  remove("000003");
  expectPairedByNumber({1, 4});
  EXPECT_EQ(gaps(), "scans 000002 to 000003 are missing in " + (folder_ / "drive/velodyne"));
}

TEST_F(LongerSequence, AnEmptyLineIsALineToo) {
  replace("poses.txt",
          "1 0 0 0 0 1 0 0 0 0 1 0\n\n1 0 0 2 0 1 0 0 0 0 1 0\n1 0 0 3 0 1 0 0 0 0 1 0\n"
          "1 0 0 4 0 1 0 0 0 0 1 0\n\n");
  expectFault("poses.txt line 2 has 0 numbers");
  remove("000001");
  expectPairedByNumber({0, 2, 3, 4});
}

/// The most memory that this process has had so far [MB].
double peakMegabytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1000.0;
  }
  return 0.0;
}

TEST_F(SequenceFolder, BlankLinesTakeNoMemory) {
  const std::string poses = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 4 0 1 0 0 0 0 1 0\n";
  const double before = peakMegabytes();
  replace("poses.txt", poses + std::string(1000000, '\n'));
  EXPECT_EQ(Sequence(folder_ / "drive").pose(1).translation().x(), 4.0);
  EXPECT_LT(peakMegabytes() - before, 50.0);
  replace("poses.txt", std::string(1000000, '\n') + poses);
  expectFault("poses.txt line 1000001 follows more than 100000 blank lines");
  EXPECT_LT(peakMegabytes() - before, 50.0);
}

TEST_F(LongerSequence, NumbersNeedNotBePadded) {
  rename("000003", "3");
  rename("000004", "0000000004");
  expectPairedByNumber({0, 1, 2, 3, 4});
}

TEST_F(LongerSequence, NamesThatPairWithNothingAreRefused) {
  rename("000004", "000009");
  expectFault("times.txt has no line 10 for scan 000009");
  rename("000009", "99999999999999999999999");
  expectFault("99999999999999999999999");
  rename("99999999999999999999999", "3");
  expectFault("scans 000003 and 3 have the same number");
  for (const char* name : {"last", "-3", "3a", "0x3", "1.5"}) {
    rename("3", name);
    expectFault(std::string(name) + ".bin is not named by the number of its scan");
    rename(name, "3");
  }
}

TEST_F(SequenceFolder, TheWriterRefusesAFolderInUse) {
  EXPECT_THROW(SequenceWriter(folder_ / "drive"), std::runtime_error);
}

}  // namespace
}  // namespace bki_mapping
