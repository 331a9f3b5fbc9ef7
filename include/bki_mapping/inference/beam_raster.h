/// @file Beams in the coordinates of one block, and the rows of voxels near them.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// A beam's line in the coordinates of one block: [voxels], from the centre of the block's first voxel.
struct LocalBeam {
  Eigen::Vector3f u;    ///< unit direction
  Eigen::Vector3f n;    ///< the line's point nearest to the block's centre
  float g, inverse_g;   ///< u_y^2 + u_z^2 > 0, and its inverse
  float rho_at_n;       ///< projection of n on the beam / beam length: 0 at the sensor, 1 at the end
  float rho_per_voxel;  ///< change of rho along u
};

/// A row of eight voxels along x, and a beam near it. The squared distance of voxel i's centre to the line is
/// distance2 + g (i - x)^2 [voxels^2]; its rho is rho + i * rho_step.
struct NearRow {
  int offset;  ///< of the row's first voxel in the block
  float distance2, x, rho, rho_step;
};

/// Half the diagonal of the lattice of a block's voxel centres [voxels].
constexpr double kLatticeRadius = 0.5 * (kBlockEdge - 1) * 1.7320508075688772;

/// Brings a beam into a block's coordinates.
/// @param block_centre relative to the sensor [m]. @param end of the beam, relative to the sensor [m].
/// @param reach [voxels] @param follow how far from the sensor the line is followed, if beyond its end [m].
/// @return false if no voxel centre of the block can lie within `reach` of that piece of the line.
inline bool toLocalBeam(const Eigen::Vector3d& block_centre, const Eigen::Vector3f& end, double resolution,
                        double reach, double follow, LocalBeam& beam) {
  const double radius = (kLatticeRadius + reach) * resolution;
  const Eigen::Vector3d e = end.cast<double>();
  const double length = e.norm();
  Eigen::Vector3d u = e / length;
  const double along = block_centre.dot(u);
  if (along < -radius || along > std::max(length, follow) + radius) return false;
  const Eigen::Vector3d to_line = along * u - block_centre;
  if (to_line.squaredNorm() > radius * radius) return false;
  if (u.y() * u.y() + u.z() * u.z() < 1e-16) u.z() = 1e-8;  // along x: turned by 1e-8 rad, so that g > 0
  const double g = u.y() * u.y() + u.z() * u.z();
  beam.u = u.cast<float>();
  beam.n = (to_line / resolution).cast<float>().array() + 0.5f * (kBlockEdge - 1);
  beam.g = static_cast<float>(g);
  beam.inverse_g = static_cast<float>(1.0 / g);
  beam.rho_at_n = static_cast<float>(along / length);
  beam.rho_per_voxel = static_cast<float>(resolution / length);
  return true;
}

/// Calls visit(const NearRow&) for every row of the block with a voxel centre within `reach` [voxels] of the
/// beam's line. Distances follow from the cross product of u with the offset from n.
template <typename Visit>
void forEachNearRow(const LocalBeam& beam, float reach, Visit&& visit) {
  const float reach2 = reach * reach;
  const float strip = reach * std::sqrt(beam.g) * 1.0001f + 1e-6f;
  for (int k = 0; k < kBlockEdge; ++k) {
    const float wz = static_cast<float>(k) - beam.n.z();
    // Rows within reach form a strip: |w_y u_z - w_z u_y| < reach sqrt(g).
    int first = 0, last = kBlockEdge - 1;
    const float middle = wz * beam.u.y();
    if (std::abs(beam.u.z()) * kBlockEdge > 1e-3f * strip) {
      const float a = (middle - strip) / beam.u.z() + beam.n.y(),
                  b = (middle + strip) / beam.u.z() + beam.n.y();
      first = static_cast<int>(std::ceil(std::clamp(std::min(a, b), 0.0f, 100.0f)));
      last = static_cast<int>(std::floor(std::clamp(std::max(a, b), -1.0f, kBlockEdge - 1.0f)));
    }
    for (int j = first; j <= last; ++j) {
      const float wy = static_cast<float>(j) - beam.n.y();
      const float c = wy * beam.u.z() - wz * beam.u.y();
      const float distance2 = c * c * beam.inverse_g;
      if (distance2 >= reach2) continue;
      const float p = wy * beam.u.y() + wz * beam.u.z();
      const float x = beam.n.x() + beam.u.x() * p * beam.inverse_g;
      const float nearest = std::clamp(x, 0.0f, kBlockEdge - 1.0f) - x;
      if (distance2 + beam.g * nearest * nearest >= reach2) continue;
      const float rho = beam.rho_at_n + (p - beam.n.x() * beam.u.x()) * beam.rho_per_voxel;
      visit(NearRow{kBlockEdge * (j + kBlockEdge * k), distance2, x, rho, beam.u.x() * beam.rho_per_voxel});
    }
  }
}

}  // namespace bki_mapping
