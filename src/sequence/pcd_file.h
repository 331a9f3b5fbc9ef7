/// @file PCD files of points: scans with the pose of their sensor, and clouds with labels.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace bki_mapping {

/// The points of a PCD file, in the frame of the file.
struct PcdPoints {
  std::vector<Eigen::Vector3d> points;  ///< [m]; some may not be finite
  /// The fields of these names; as long as `points`, or empty if the file has no such field.
  std::vector<double> intensity, label;
};

/// Reads a file with the fields x, y and z: ASCII, binary or compressed. Sizes are compared with that of the
/// file before memory is taken. @throws std::runtime_error in one sentence if the file cannot be read.
PcdPoints readPcdPoints(const std::string& path);

/// The pose in the header's line VIEWPOINT. @throws std::runtime_error in one sentence if there is none.
Eigen::Isometry3d readPcdViewpoint(const std::string& path);

/// Writes a binary file with the fields x, y, z [m] and intensity by AtomicFile. All are float32; x, y and z
/// are float64 if the points have another origin than the frame of the file.
/// @param points relative to `origin`. @param intensity as long as `points`. @param viewpoint pose of the
/// sensor. @throws std::runtime_error if that fails.
void writePcdPoints(const std::string& path, const std::vector<Eigen::Vector3f>& points,
                    const Eigen::Vector3d& origin, const std::vector<float>& intensity,
                    const Eigen::Isometry3d& viewpoint);

}  // namespace bki_mapping
