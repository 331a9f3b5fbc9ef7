/// @file Reads files of poses, and of the calibration that leads to the sensor.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace bki_mapping {

/// A line of a file of poses. Faults are sentences with the file and the line; "" if there is none.
struct PoseLine {
  std::size_t number = 0;  ///< of the line, counted from 1
  bool blank = false;
  std::optional<double> seconds;  ///< the stamp, in files that have stamps
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::string fault;           ///< why the line has no pose
  std::string rotation_fault;  ///< why it has no rotation; it has a position even so
};

/// The lines of a file of poses. Blank lines count, except at the end; comments, which begin with #, do not.
struct PoseFile {
  std::vector<PoseLine> lines;
  bool has_stamps = false;
};

/// A rigid transform from the numbers of a 3x4 or 4x4 matrix, row by row; the rotation is made orthonormal.
/// @param what the numbers are of, for the error. @throws std::runtime_error if it is no rigid transform.
Eigen::Isometry3d rigidTransform(const std::vector<double>& numbers, const std::string& what);

/// The 3x4 matrix of a transform, row by row, with all digits.
std::string rowOf(const Eigen::Isometry3d& T);

/// Reads `Tr` of a calib.txt: T_camera_sensor. @throws std::runtime_error if the file cannot be read, or has
/// no such rigid transform.
Eigen::Isometry3d readCalibration(const std::string& path);

/// Reads a text file with a pose on each line. The first line with a known number of numbers decides which of
/// these formats the file has:
/// - 12 numbers: a 3x4 matrix, row by row (KITTI); 16 numbers: a 4x4 matrix, whose last row is 0 0 0 1;
/// - 8 numbers: `seconds x y z qx qy qz qw` (TUM RGB-D benchmark); lines may lack the rotation.
/// @param remedy ends the sentence if the file cannot be opened. @throws std::runtime_error then, and if more
/// than 100,000 blank lines in a row are before a pose.
PoseFile readPoseFile(const std::string& path, const std::string& remedy);

}  // namespace bki_mapping
