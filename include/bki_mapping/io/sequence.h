/// @file Reads and writes sequences of scans in SemanticKITTI's layout.
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
  std::vector<std::uint32_t> labels;  ///< raw labels (lower 16 bits of the values in the file)
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  std::uint64_t stamp = 0;  ///< [ns], after kFirstStamp

  Scan scan() const { return scanFromSensorFrame(T_map_sensor, points, labels, stamp); }
};

/// A folder with velodyne/NNNNNN.bin, LABELS/NNNNNN.label, poses.txt (3x4 row-major, camera frame of scan 0),
/// calib.txt (Tr: sensor to camera) and, optionally, times.txt [s]; without it scans are 0.1 s apart. Line
/// N + 1 of poses and times belongs to scan NNNNNN = N, even if earlier scans are missing. The map frame is
/// the sensor's frame at the pose in the first line. Rotations are orthonormalised.
class Sequence {
 public:
  /// Offset added to all times [ns], because time 0 means "the latest" to tf.
  static constexpr std::uint64_t kFirstStamp = 1000000000;

  /// @param labels name of the folder with the labels, or an absolute path.
  /// @throws std::runtime_error in one sentence: a missing folder or file, a scan whose name is not a number,
  /// a value that is not a number, a singular or missing calibration, a scan without a pose or time.
  explicit Sequence(const std::string& folder, const std::string& labels = "labels");

  /// Number of scans that exist; the index `i` below runs over these, without gaps.
  std::size_t size() const { return poses_.size(); }
  const std::string& folder() const { return folder_; }
  /// File name of a scan without its extension.
  const std::string& name(std::size_t i) const { return names_[i]; }
  /// The number in the file name.
  std::size_t number(std::size_t i) const { return numbers_[i]; }
  /// The scans missing between the first and the last one, as a clause; "" if there are none.
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

/// Writes a folder of labels for the scans of a sequence, as Sequence reads them.
class LabelWriter {
 public:
  /// Creates sequence/labels. @param labels name of the folder, or an absolute path.
  /// @throws std::runtime_error if that fails, or if the folder is not empty.
  LabelWriter(const std::string& sequence, const std::string& labels);
  /// @param name of the scan: Sequence::name. @throws std::runtime_error if the file cannot be written.
  void write(const std::string& name, const std::vector<std::uint32_t>& labels) const;

 private:
  std::string folder_;
};

/// Writes frames in the same layout; Tr is the identity.
class SequenceWriter {
 public:
  /// Creates the folders. @throws std::runtime_error if that fails, or if `folder` already holds scans.
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
