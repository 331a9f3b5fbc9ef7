/// @file The directions of beams, precise enough to tell neighbouring ones apart.
#pragma once

#include <vector>

#include "beams/beams.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// Unit vectors as sums of two floats: the difference of two that are close is then precise, too. Loops may
/// read up to kBeamPadding elements past the end.
struct BeamDirectionArrays {
  const float *x, *y, *z;                 ///< rounded
  const float *x_rest, *y_rest, *z_rest;  ///< what rounding has taken
  const float* by_length;  ///< 1 / length [1 / voxel]; 0 for a beam without length, whose direction is 0
};

/// The same, to be written.
struct BeamDirectionTargets {
  float *x, *y, *z, *x_rest, *y_rest, *z_rest, *by_length;
};

struct LineKernels;

/// A point as seen from the sensor, likewise.
struct PointDirection {
  float direction[3], rest[3];
  float distance;  ///< [voxels]

  /// @param point from the sensor [voxels]; not 0.
  explicit PointDirection(const Eigen::Vector3d& point) : distance(static_cast<float>(point.norm())) {
    const Eigen::Vector3d exact = point.normalized();
    for (int axis = 0; axis < 3; ++axis) {
      direction[axis] = static_cast<float>(exact[axis]);
      rest[axis] = static_cast<float>(exact[axis] - static_cast<double>(direction[axis]));
    }
  }
};

/// The directions of a scan's beams. Keeps its memory from scan to scan.
class BeamDirections {
 public:
  /// @param resolution [m].
  void set(const Beams& beams, double resolution, const LineKernels& kernels, ThreadPool& pool);

  BeamDirectionArrays arrays() const {
    const auto part = [&](std::size_t n) { return parts_[n].data(); };
    return {part(0), part(1), part(2), part(3), part(4), part(5), part(6)};
  }

 private:
  std::vector<float> parts_[7];  ///< in the order of BeamDirectionArrays
};

}  // namespace bki_mapping
