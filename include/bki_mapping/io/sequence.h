/// @file Reads and writes sequences of scans, in the layouts of SemanticKITTI and of the DynamicMap
/// benchmark.
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
  std::vector<std::uint32_t> labels;  ///< as in the file; ClassTable knows which bits are the class
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  std::uint64_t stamp = 0;  ///< [ns], after kFirstStamp

  Scan scan() const { return scanFromSensorFrame(T_map_sensor, points, labels, stamp); }
};

enum class SequenceLayout {
  kSemanticKitti,  ///< velodyne/, labels/, poses.txt, calib.txt
  kDynamicMap,     ///< pcd/; labels/ is optional
};

/// A folder with velodyne/NNNNNN.bin, LABELS/NNNNNN.label, poses.txt (3x4 row-major, camera frame of scan 0),
/// calib.txt (Tr: sensor to camera) and, optionally, times.txt [s]; without it scans are 0.1 s apart. Line
/// N + 1 of poses and times belongs to scan NNNNNN = N, even if earlier scans are missing. The map frame is
/// the sensor's frame at the pose in the first line, or, with a file of poses in the map frame, the sensor's
/// frame at the identity. Rotations are orthonormalised.
///
/// Or a folder of the DynamicMap benchmark, with pcd/NNNNNN.pcd: points in the map frame, and the pose of the
/// sensor in VIEWPOINT. LABELS and times.txt are optional there; without labels, all are 0.
class Sequence {
 public:
  /// Offset added to all times [ns], because time 0 means "the latest" to tf.
  static constexpr std::uint64_t kFirstStamp = 1000000000;

  /// @param labels name of the folder with the labels, or an absolute path. @param map_poses file like
  /// poses.txt, whose poses are in the map frame; "": poses.txt, relative to its first pose.
  /// @throws std::runtime_error in one sentence: a missing folder or file, a scan whose name is not a number,
  /// a value that is not a number, a singular or missing calibration, a scan without a pose or time.
  explicit Sequence(const std::string& folder, const std::string& labels = "labels",
                    const std::string& map_poses = "");

  /// Number of scans that exist; the index `i` below runs over these, without gaps.
  std::size_t size() const { return poses_.size(); }
  const std::string& folder() const { return folder_; }
  SequenceLayout layout() const { return layout_; }
  /// Whether the scans have labels.
  bool labelled() const { return labelled_; }
  /// File name of a scan without its extension.
  const std::string& name(std::size_t i) const { return names_[i]; }
  /// The number in the file name.
  std::size_t number(std::size_t i) const { return numbers_[i]; }
  /// T_map_sensor of a scan.
  const Eigen::Isometry3d& pose(std::size_t i) const { return poses_[i]; }
  /// The scans missing between the first and the last one, as a clause; "" if there are none.
  std::string gaps() const;
  /// @throws std::runtime_error if the files cannot be read, or the numbers of points and labels differ.
  SequenceFrame read(std::size_t i) const;

 private:
  void addScan(std::size_t number, const std::string& name, const Eigen::Isometry3d& T_map_sensor,
               double seconds);

  std::string folder_, labels_;
  SequenceLayout layout_ = SequenceLayout::kSemanticKitti;
  bool labelled_ = true;
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

/// Writes frames in the same layouts, with labels and times; Tr is the identity.
class SequenceWriter {
 public:
  /// Creates the folders. @throws std::runtime_error if that fails, or if `folder` already holds scans.
  explicit SequenceWriter(const std::string& folder, SequenceLayout layout = SequenceLayout::kSemanticKitti);
  /// @throws std::runtime_error if a file cannot be written.
  void write(const SequenceFrame& frame);
  /// Writes times.txt and, in SemanticKITTI's layout, poses.txt and calib.txt.
  void finish();

 private:
  std::string folder_, poses_, times_;
  SequenceLayout layout_;
  std::size_t count_ = 0;
};

}  // namespace bki_mapping
