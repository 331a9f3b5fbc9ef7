/// @file Scans from a folder in SemanticKITTI's layout.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "bki_mapping/core/scan.h"

namespace bki_mapping {

/// One frame of a sequence, in the sensor frame.
struct SequenceFrame {
  std::vector<Eigen::Vector3f> points;  ///< [m]
  std::vector<float> remissions;
  std::vector<std::uint32_t> labels;  ///< raw class numbers (lower 16 bits of the file's)
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  std::uint64_t stamp = 0;  ///< [ns], after kFirstStamp

  Scan scan() const { return scanFromSensorFrame(T_map_sensor, points, labels, stamp); }
};

/// A folder with velodyne/NNNNNN.bin, LABELS/NNNNNN.label, poses.txt (3x4 row-major, camera frame of scan 0),
/// calib.txt (Tr: sensor to camera) and, optionally, times.txt [s]; without it scans are 0.1 s apart. Line
/// N + 1 of poses and times belongs to the scan of number N, whether or not others are missing. The map frame
/// is the sensor's frame at the first line's pose. Rotations are made orthonormal.
class Sequence {
 public:
  /// Added to all times, because ROS takes time 0 to mean "the latest" [ns].
  static constexpr std::uint64_t kFirstStamp = 1000000000;

  /// @param labels name of the folder with labels.
  /// @throws std::runtime_error in one sentence: a missing folder or file, a scan whose name is no number, an
  /// unreadable number, a singular or missing calibration, a scan without a pose or time.
  explicit Sequence(const std::string& folder, const std::string& labels = "labels");

  /// Scans that there are; `i` below counts them, gaps left out.
  std::size_t size() const { return poses_.size(); }
  /// File name of a frame without its ending.
  const std::string& name(std::size_t i) const { return names_[i]; }
  /// The number in its name.
  std::size_t number(std::size_t i) const { return numbers_[i]; }
  /// Which numbers between the first and the last scan are missing, as a clause; "" if none.
  std::string gaps() const;
  /// @throws std::runtime_error if the files cannot be read, or the numbers of points and labels differ.
  SequenceFrame read(std::size_t i) const;

 private:
  std::string folder_, labels_;
  std::vector<std::size_t> numbers_;
  std::vector<std::string> names_;
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<std::uint64_t> stamps_;
};

/// Writes frames in the same layout, with Tr the identity.
class SequenceWriter {
 public:
  /// Makes the folders. @throws std::runtime_error if that fails, or `folder` already holds scans.
  explicit SequenceWriter(const std::string& folder);
  /// @throws std::runtime_error if a file cannot be written.
  void write(const SequenceFrame& frame);
  /// Writes poses.txt, times.txt and calib.txt.
  void finish();

 private:
  std::string folder_, poses_, times_;
  std::size_t count_ = 0;
};

}  // namespace bki_mapping
