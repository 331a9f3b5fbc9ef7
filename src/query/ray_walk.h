/// @file The walk of a ray through the voxels of a grid.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// Walks a ray from cell to cell (Amanatides and Woo, A Fast Voxel Traversal Algorithm for Ray Tracing,
/// 1987), where a cell is a voxel or a cube of 2^n voxels. Where the ray crosses a face is computed from the
/// face's index each time, not added up, so that rounding does not grow and large steps meet the same voxels
/// as small ones.
///
/// Axes along which the ray descends are mirrored, so that it ascends along all: voxel i becomes -1 - i,
/// which is ~i. A ray that starts on a face thus starts in the voxel ahead.
class RayWalk {
 public:
  /// @param origin in units of voxels, within the grid. @param direction which is the unit of lengths along
  /// the ray [voxels]; its largest coordinate is about 1.
  RayWalk(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      mirror_[a] = direction[axis] < 0.0 ? -1 : 0;
      origin_[a] = mirror_[a] ? -origin[axis] : origin[axis];
      slope_[a] = std::abs(direction[axis]);
      index_[a] = static_cast<std::int32_t>(std::floor(origin_[a]));
    }
    setNext();
  }

  /// The present voxel.
  VoxelIndex voxel() const {
    return {{index_[0] ^ mirror_[0], index_[1] ^ mirror_[1], index_[2] ^ mirror_[2]}};
  }
  /// Where the ray enters the present voxel [directions].
  double entered() const { return entered_; }

  /// Moves on to the next voxel. @return whether it lies in the same cube of 2^n voxels, n = `shift`.
  bool step(int shift) {
    entered_ = std::min({next_[0], next_[1], next_[2]});
    std::int32_t changed = 0;
    for (std::size_t a = 0; a < 3; ++a) {  // more than one axis where the ray passes through an edge
      const bool crosses = next_[a] <= entered_;
      const std::int32_t before = index_[a];
      index_[a] += crosses;
      changed |= before ^ index_[a];
      next_[a] = crosses ? faceAt(a, index_[a] + 1) : next_[a];
    }
    return changed >> shift == 0;
  }

  /// Moves on to the first voxel outside of the present cube of 2^n voxels, n = `shift`. @return the last
  /// voxel in the cube, or, where the ray leaves through an edge, one beyond which it crosses none in the
  /// cube.
  VoxelIndex leave(int shift) {
    std::array<std::int32_t, 3> face;
    std::array<double, 3> at;
    for (std::size_t a = 0; a < 3; ++a) {
      face[a] = ((index_[a] >> shift) + 1) * (1 << shift);
      at[a] = faceAt(a, face[a]);
    }
    entered_ = std::min({at[0], at[1], at[2]});
    std::array<std::int32_t, 3> last;
    for (std::size_t a = 0; a < 3; ++a) {
      index_[a] = at[a] <= entered_ ? face[a] : indexAfter(a, entered_);
      last[a] = std::min(index_[a], face[a] - 1) ^ mirror_[a];
    }
    setNext();
    return {{last[0], last[1], last[2]}};
  }

  /// Moves on to the voxel that the ray crosses just after `length`, if that is ahead [directions].
  void skipTo(double length) {
    if (!(length > entered_)) return;
    for (std::size_t a = 0; a < 3; ++a) index_[a] = indexAfter(a, length);
    entered_ = length;
    setNext();
  }

 private:
  /// Where the ray crosses the lower face of the voxels of an index; rises with the index. Rounded once, if
  /// index - origin is exact: faces that a ray crosses at the same point are then found at the same length.
  /// @param index of a face ahead of the origin. @return infinity if the ray does not move along the axis.
  double faceAt(std::size_t a, std::int32_t index) const { return (index - origin_[a]) / slope_[a]; }
  /// The index along an axis just after a length: that of the last face crossed by then.
  std::int32_t indexAfter(std::size_t a, double length) const {
    auto index = std::max(index_[a], floorToInt(origin_[a] + length * slope_[a]));
    while (faceAt(a, index + 1) <= length) ++index;
    while (index > index_[a] && faceAt(a, index) > length) --index;
    return index;
  }
  void setNext() {
    for (std::size_t a = 0; a < 3; ++a) next_[a] = faceAt(a, index_[a] + 1);
  }

  std::array<double, 3> origin_, slope_;  ///< slope_: of the direction along each axis, >= 0
  std::array<std::int32_t, 3> mirror_;    ///< -1: descends
  std::array<std::int32_t, 3> index_;     ///< of the present voxel, mirrored
  std::array<double, 3> next_;            ///< where the ray leaves the present voxel across each axis
  double entered_ = 0.0;
};

}  // namespace bki_mapping
