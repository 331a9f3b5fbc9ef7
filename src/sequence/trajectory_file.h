/// @file Trajectories from files.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/sequence/sequence.h"

namespace bki_mapping {

/// Positions of the sensor.
struct Trajectory {
  std::string name;                     ///< for people
  std::vector<Eigen::Vector3d> points;  ///< map frame [m]
};

/// Reads where the sensor was, in the map frame: the poses of a sequence, if `path` is a folder; otherwise
/// those of a file in one of the formats of readPoseFile().
/// @throws std::runtime_error in one sentence: no such file, a line that is not such a pose, no pose at all,
/// or as Sequence.
Trajectory readTrajectory(const std::string& path);

/// Poses of the lidar.
struct LidarPoses {
  std::vector<Eigen::Isometry3d> poses;  ///< in the frame of the file, as with map_sequence --poses
  std::vector<double> seconds;           ///< their stamps; empty in a file without stamps
  Eigen::Isometry3d T_camera_sensor = Eigen::Isometry3d::Identity();  ///< identity for poses of the lidar
};

/// Reads the poses of a file in one of the formats of readPoseFile() as those of a sequence are read: by
/// default, poses with stamps are of the lidar, and others of the camera.
/// @param calibration file with `Tr`, for poses of the camera. @throws std::runtime_error in one sentence: no
/// such file, a line that is not such a pose or lacks it, no pose at all.
LidarPoses readLidarPoses(const std::string& path, const std::string& calibration,
                          std::optional<PosesIn> poses_in);

}  // namespace bki_mapping
