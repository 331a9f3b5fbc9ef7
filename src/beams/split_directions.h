/// @file Directions as unit vectors with two floats for each coordinate, which tell neighbouring beams apart:
/// the differences of close directions are precise, too.
#pragma once

#include <vector>

#include "beams/beams.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// The directions of beams. Loops may read up to kBeamPadding elements past the end.
struct SplitDirectionArrays {
  const float *x, *y, *z;                 ///< rounded
  const float *x_rest, *y_rest, *z_rest;  ///< what rounding has taken
  const float* by_length;  ///< 1 / length [1 / voxel]; 0 for a beam without length, whose direction is 0
};

/// The same, to be written.
struct SplitDirectionTargets {
  float *x, *y, *z, *x_rest, *y_rest, *z_rest, *by_length;
};

struct LineKernels;

/// The direction of a point as seen from the sensor.
struct SplitPointDirection {
  float direction[3], rest[3];
  float distance;  ///< [voxels]

  /// @param point from the sensor [voxels]; not 0.
  explicit SplitPointDirection(const Eigen::Vector3d& point) : distance(static_cast<float>(point.norm())) {
    const Eigen::Vector3d exact = point.normalized();
    for (int axis = 0; axis < 3; ++axis) {
      direction[axis] = static_cast<float>(exact[axis]);
      rest[axis] = static_cast<float>(exact[axis] - static_cast<double>(direction[axis]));
    }
  }
};

/// The directions of a scan's beams. Keeps its memory from scan to scan.
class SplitDirections {
 public:
  /// @param resolution [m].
  void set(const Beams& beams, double resolution, const LineKernels& kernels, ThreadPool& pool);

  SplitDirectionArrays arrays() const {
    const auto part = [&](std::size_t n) { return parts_[n].data(); };
    return {part(0), part(1), part(2), part(3), part(4), part(5), part(6)};
  }

 private:
  std::vector<float> parts_[7];  ///< in the order of SplitDirectionArrays
};

}  // namespace bki_mapping
