/// @file Trajectories from files.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

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

}  // namespace bki_mapping
