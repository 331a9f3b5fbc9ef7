/// @file The rows of voxels of a block near a beam. A row is the 8 voxels along x.
#pragma once

#include <cmath>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// A beam's line in the coordinates of one block [voxels], relative to the centre of the block's first voxel.
struct LocalBeam {
  float ux, uy, uz;     ///< unit direction
  float nx, ny, nz;     ///< the point n of the line that is nearest to the block's centre
  float g, inverse_g;   ///< uy^2 + uz^2 > 0, and its inverse
  float rho_at_n;       ///< projection of n on the beam: 0 at the sensor, 1 at the end
  float rho_per_voxel;  ///< change of rho along u
};

/// A row of eight voxels along x, and a beam near it. The squared distance of voxel i's centre from the line
/// is distance2 + g (i - x)^2 [voxels^2]; its rho is rho + i * rho_step.
struct NearRow {
  int offset;  ///< of the row's first voxel in the block
  float distance2, x, rho, rho_step;
};

/// Half the diagonal of the cube that the voxel centres of a block span [voxels].
constexpr double kLatticeRadius = 0.5 * (kBlockEdge - 1) * 1.7320508075688772;

/// The rows `first` to `last`, inclusive; empty if last < first.
struct RowSpan {
  int first, last;
};

/// The rows of a block, 0 to 7, with low <= row <= high.
[[gnu::always_inline]] inline RowSpan rowsBetween(float low, float high) {
  const float end = kBlockEdge - 1;
  if (!(low <= end && high >= 0.0f)) return {0, -1};
  return {low > 0.0f ? static_cast<int>(std::ceil(low)) : 0,
          high < end ? static_cast<int>(high) : kBlockEdge - 1};
}

/// The rows, on one of the axes y and z, that a beam may reach anywhere in the block: the interval that the
/// line covers over x = 0 to 7, widened by the half width of the tube of radius `reach` at fixed x.
/// @param uw, nw components of u and n on that axis.
[[gnu::always_inline]] inline RowSpan rowsNear(float ux, float uw, float nx, float nw, float reach) {
  if (std::abs(ux) < 0.25f) return {0, kBlockEdge - 1};
  const float slope = uw / ux;
  const float half = reach * std::sqrt(1.0f + slope * slope) * 1.0001f + 1e-4f;
  const float at_first = nw - nx * slope, at_last = at_first + (kBlockEdge - 1) * slope;
  return at_first < at_last ? rowsBetween(at_first - half, at_last + half)
                            : rowsBetween(at_last - half, at_first + half);
}

/// Calls visit(const NearRow&) for every row of the block with a voxel centre within `reach` [voxels] of the
/// beam's line. Distances are those of the cross product of u and the offset from n.
template <typename Visit>
[[gnu::always_inline]] inline void forEachNearRow(const LocalBeam& beam, float reach, Visit&& visit) {
  const RowSpan ys = rowsNear(beam.ux, beam.uy, beam.nx, beam.ny, reach);
  if (ys.first > ys.last) return;
  const RowSpan zs = rowsNear(beam.ux, beam.uz, beam.nx, beam.nz, reach);
  const float reach2 = reach * reach, last_index = kBlockEdge - 1;
  for (int k = zs.first; k <= zs.last; ++k) {
    const float wz = static_cast<float>(k) - beam.nz;
    for (int j = ys.first; j <= ys.last; ++j) {
      const float wy = static_cast<float>(j) - beam.ny;
      const float c = wy * beam.uz - wz * beam.uy;
      const float distance2 = c * c * beam.inverse_g;
      const float p = wy * beam.uy + wz * beam.uz;
      const float x = beam.nx + beam.ux * p * beam.inverse_g;
      const float nearest = x < 0.0f ? x : (x > last_index ? x - last_index : 0.0f);
      if (distance2 + beam.g * nearest * nearest >= reach2) continue;
      const float rho = beam.rho_at_n + (p - beam.nx * beam.ux) * beam.rho_per_voxel;
      visit(NearRow{kBlockEdge * (j + kBlockEdge * k), distance2, x, rho, beam.ux * beam.rho_per_voxel});
    }
  }
}

}  // namespace bki_mapping
