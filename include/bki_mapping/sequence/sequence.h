/// @file Reads and writes sequences of scans, in the layouts of SemanticKITTI and of the DynamicMap
/// benchmark.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
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
  /// The scan in the axes of the sensor, which is its origin.
  Scan recordedScan() const {
    return scanFromSensorFrame(Eigen::Isometry3d::Identity(), points, labels, stamp);
  }
};

enum class SequenceLayout {
  kSemanticKitti,  ///< velodyne/, labels/, poses.txt, calib.txt
  kDynamicMap,     ///< pcd/; labels/ is optional
};

/// Which sensor poses are of: the camera of calib.txt, or the lidar itself.
enum class PosesIn { kCamera, kLidar };

struct SequenceOptions {
  /// Name of the folder with the labels, or an absolute path; "": the scans have no labels, and all are 0.
  std::string labels = "labels";
  /// File whose poses are in the map frame; "": poses.txt, relative to its first pose.
  std::string map_poses;
  /// By default, poses with stamps are of the lidar, and others of the camera.
  std::optional<PosesIn> poses_in;
};

/// A folder with velodyne/NNNNNN.bin, LABELS/NNNNNN.label, poses.txt, calib.txt (Tr: sensor to camera) and,
/// optionally, times.txt [s]; without it scans are 0.1 s apart. Poses are 3x4 or 4x4 matrices, row by row, or
/// stamped (docs/files.md). Line N + 1 of poses and times belongs to scan NNNNNN = N, even if earlier scans
/// are missing; a stamped pose belongs to the scan of its time, if there is a times.txt. The map frame is the
/// sensor's frame at the pose in the first line, or, with a file of poses in the map frame, the sensor's
/// frame at the identity. Rotations are orthonormalised. Poses of the lidar need no calib.txt.
///
/// Or a folder of the DynamicMap benchmark, with pcd/NNNNNN.pcd: points in the map frame, and the pose of the
/// sensor in VIEWPOINT. LABELS and times.txt are optional there; without labels, all are 0.
class Sequence {
 public:
  /// Offset added to all times [ns], because time 0 means "the latest" to tf.
  static constexpr std::uint64_t kFirstStamp = 1000000000;

  /// @throws std::runtime_error in one sentence: a missing folder or file, a scan whose name is not a number,
  /// a singular or missing calibration, no pose in the first line. A scan whose pose or time is missing or
  /// wrong is refused when it is asked for.
  explicit Sequence(const std::string& folder, const SequenceOptions& options = {});

  /// Number of scans that exist; the index `i` below runs over these, without gaps.
  std::size_t size() const { return scans_.size(); }
  const std::string& folder() const { return folder_; }
  SequenceLayout layout() const { return layout_; }
  /// Whether the scans have labels.
  bool labelled() const { return labelled_; }
  /// File name of a scan without its extension.
  const std::string& name(std::size_t i) const { return scans_[i].name; }
  /// The number in the file name.
  std::size_t number(std::size_t i) const { return scans_[i].number; }
  /// T_map_sensor of a scan. @throws std::runtime_error if its pose or time is missing or wrong.
  const Eigen::Isometry3d& pose(std::size_t i) const;
  /// Time of a scan [ns]. @throws as pose().
  std::uint64_t stamp(std::size_t i) const;
  /// Which sensor the poses are of.
  PosesIn posesIn() const { return poses_in_; }
  /// The scans missing between the first and the last one, as a clause; "" if there are none.
  std::string gaps() const;
  /// @throws std::runtime_error as pose(), or if the files cannot be read, or the numbers of points and
  /// labels differ.
  SequenceFrame read(std::size_t i) const;

 private:
  struct Entry {
    std::size_t number;
    std::string name;
    std::string fault;  ///< why there is no pose or time; "": there are
    Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
    std::uint64_t stamp = 0;
  };
  /// @throws std::runtime_error if the scans should have labels, and there is no folder of them.
  void checkLabels() const;
  /// @throws std::runtime_error if its pose or time is missing or wrong.
  const Entry& placed(std::size_t i) const;

  std::string folder_, labels_;
  SequenceLayout layout_ = SequenceLayout::kSemanticKitti;
  PosesIn poses_in_ = PosesIn::kLidar;
  bool labelled_ = true;
  std::vector<Entry> scans_;
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

/// Writes frames in the same layouts, with labels and times.
class SequenceWriter {
 public:
  /// Creates the folders. @throws std::runtime_error if that fails, or if `folder` already holds scans.
  /// @param T_camera_sensor of calib.txt; poses.txt has the poses of the camera. By default, it is the
  /// identity, and they are those of the lidar.
  explicit SequenceWriter(const std::string& folder, SequenceLayout layout = SequenceLayout::kSemanticKitti,
                          const Eigen::Isometry3d& T_camera_sensor = Eigen::Isometry3d::Identity());
  /// @throws std::runtime_error if a file cannot be written.
  void write(const SequenceFrame& frame);
  /// Writes times.txt and, in SemanticKITTI's layout, poses.txt and calib.txt.
  void finish();

 private:
  std::string folder_, poses_, times_;
  SequenceLayout layout_;
  Eigen::Isometry3d T_camera_sensor_;
  std::size_t count_ = 0;
};

}  // namespace bki_mapping
