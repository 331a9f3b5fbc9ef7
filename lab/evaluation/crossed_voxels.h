/// @file The voxels that the beams of a scan cross.
#pragma once

#include <cstddef>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/core/scan.h"

namespace bki_mapping {

/// Calls visit(const VoxelIndex&) for the voxels that every 16th beam crosses, up to a voxel's edge before
/// its end; often more than once. Not all beams, which bounds the time. Skips points outside of the grid.
template <typename Visit>
void forEachCrossedVoxel(const Scan& scan, const GridGeometry& geometry, Visit&& visit) {
  constexpr std::size_t kBeamStride = 16;
  const double step = 0.5 * geometry.resolution();
  for (std::size_t i = 0; i < scan.points.size(); i += kBeamStride) {
    const Eigen::Vector3d way = scan.points[i].cast<double>();
    if (!geometry.contains(scan.origin + way)) continue;
    for (double at = 0.0; at < way.norm() - geometry.resolution(); at += step) {
      visit(geometry.voxelAt(scan.origin + at * way.normalized()));
    }
  }
}

}  // namespace bki_mapping
