/// @file The voxels that shapes overlap, as rows along x. All in units of voxels.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace bki_mapping {

/// Voxels `begin` to `end` - 1 along an axis.
struct VoxelRange {
  std::int32_t begin, end;
};

/// The voxels that contain more than an end of an interval; at least the one that contains its beginning.
inline VoxelRange overlapped(double low, double high) {
  const auto begin = static_cast<std::int32_t>(std::floor(low));
  return {begin, std::max(begin + 1, static_cast<std::int32_t>(std::ceil(high)))};
}

/// Distance from a coordinate to the voxels of an index.
inline double distanceToVoxel(double coordinate, std::int32_t index) {
  return std::max({0.0, index - coordinate, coordinate - (index + 1)});
}

/// Calls visit(y, z, range of x) for the rows of voxels that a sphere overlaps.
template <typename Visit>
void forEachRow(const Eigen::Vector3d& centre, double radius, Visit&& visit) {
  const VoxelRange rows_z = overlapped(centre.z() - radius, centre.z() + radius),
                   rows_y = overlapped(centre.y() - radius, centre.y() + radius);
  for (std::int32_t z = rows_z.begin; z < rows_z.end; ++z) {
    for (std::int32_t y = rows_y.begin; y < rows_y.end; ++y) {
      const double dz = distanceToVoxel(centre.z(), z), dy = distanceToVoxel(centre.y(), y);
      const double rest = radius * radius - dz * dz - dy * dy;
      if (!(rest > 0.0)) continue;
      visit(y, z, overlapped(centre.x() - std::sqrt(rest), centre.x() + std::sqrt(rest)));
    }
  }
}

/// Decides which voxels an oriented box overlaps, by the separating axes of two boxes (Gottschalk, Lin and
/// Manocha, OBBTree, 1996). Each axis bounds a linear function of a voxel's centre, so that the voxels of a
/// row form one range, the intersection of all axes' ranges.
class OrientedBoxRows {
 public:
  OrientedBoxRows(const Eigen::Vector3d& centre, const Eigen::Matrix3d& rotation,
                  const Eigen::Vector3d& half_extents)
      : centre_(centre), extents_(rotation.cwiseAbs() * half_extents) {
    for (Eigen::Index own = 0; own < 3; ++own) {
      add(rotation.col(own), rotation, half_extents);
      for (Eigen::Index world = 0; world < 3; ++world) {
        add(Eigen::Vector3d::Unit(world).cross(rotation.col(own)), rotation, half_extents);
      }
    }
  }

  /// Half the extents of the box about it.
  const Eigen::Vector3d& extents() const { return extents_; }

  /// Calls visit(y, z, range of x) for the rows of voxels that the box overlaps.
  template <typename Visit>
  void forEach(Visit&& visit) const {
    const VoxelRange rows_z = along(2), rows_y = along(1);
    for (std::int32_t z = rows_z.begin; z < rows_z.end; ++z) {
      for (std::int32_t y = rows_y.begin; y < rows_y.end; ++y) {
        const VoxelRange row = rowAt(y, z);
        if (row.begin < row.end) visit(y, z, row);
      }
    }
  }

 private:
  /// The centres c of overlapped voxels have |axis . (c - centre)| < bound.
  struct Axis {
    Eigen::Vector3d axis;
    double bound, inverse_x;
  };

  void add(const Eigen::Vector3d& axis, const Eigen::Matrix3d& rotation,
           const Eigen::Vector3d& half_extents) {
    // Of parallel edges: adds nothing to the axes of the faces, and would divide by rounding errors.
    constexpr double kParallel = 1e-9;
    if (axis.squaredNorm() < kParallel * kParallel) return;
    const double bound =
        (rotation.transpose() * axis).cwiseAbs().dot(half_extents) + 0.5 * axis.cwiseAbs().sum();
    axes_[count_++] = {axis, bound, std::abs(axis.x()) < kParallel ? 0.0 : 1.0 / axis.x()};
  }
  VoxelRange along(Eigen::Index a) const {
    return overlapped(centre_[a] - extents_[a], centre_[a] + extents_[a]);
  }
  VoxelRange rowAt(std::int32_t y, std::int32_t z) const {
    const double dy = y + 0.5 - centre_.y(), dz = z + 0.5 - centre_.z();
    // Of the centres' x, relative to the box's centre:
    double low = -extents_.x() - 0.5, high = extents_.x() + 0.5;
    for (std::size_t a = 0; a < count_; ++a) {
      const Axis& axis = axes_[a];
      const double fixed = axis.axis.y() * dy + axis.axis.z() * dz;
      if (axis.inverse_x == 0.0) {
        if (std::abs(fixed) >= axis.bound) return {0, 0};
        continue;
      }
      const double middle = -fixed * axis.inverse_x, half = std::abs(axis.bound * axis.inverse_x);
      low = std::max(low, middle - half);
      high = std::min(high, middle + half);
    }
    if (!(low < high)) return {0, 0};
    return {static_cast<std::int32_t>(std::floor(centre_.x() + low - 0.5)) + 1,
            static_cast<std::int32_t>(std::ceil(centre_.x() + high - 0.5))};
  }

  Eigen::Vector3d centre_, extents_;
  std::array<Axis, 12> axes_;
  std::size_t count_ = 0;
};

}  // namespace bki_mapping
