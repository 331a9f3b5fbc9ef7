/// @file A group of blocks as seen from the sensor.
#pragma once

#include <cmath>
#include <cstdint>

#include "beams/beams.h"
#include "beams/raster/line_setup.h"
#include "map/block_group.h"

namespace bki_mapping {

/// Lengths are in voxels.
struct BeamBox {
  double first[3];       ///< centre of the group's first voxel, relative to the sensor
  double reach;          ///< length of the kernel
  std::uint64_t blocks;  ///< those whose sums are wanted, as in BlockGroup; below, those that matter

  static constexpr double kHalf = 0.5 * (kGroupVoxels - 1);  ///< from the first voxel's centre to the box's

  Eigen::Vector3d centre() const { return Eigen::Vector3d(first[0], first[1], first[2]).array() + kHalf; }
};

/// A beam's way through a box: the slices, first to last, in which it may reach blocks that matter.
struct BeamPass {
  std::uint32_t beam;
  std::int32_t first, last;
  std::int32_t slicing;  ///< as BeamSlicing numbers them
};

/// The blocks that matter in a layer of a box across a main axis: bit side + 4 height.
inline std::uint32_t layerOf(std::uint64_t blocks, int axis, int layer) {
  constexpr int kStep[3] = {1, kGroupEdge, kGroupEdge * kGroupEdge};
  std::uint32_t bits = 0;
  for (int n = 0; n < kGroupEdge * kGroupEdge; ++n) {
    const int number = layer * kStep[axis] + n % kGroupEdge * kStep[kSideAxis[axis]] +
                       n / kGroupEdge * kStep[kHeightAxis[axis]];
    bits |= static_cast<std::uint32_t>(blocks >> number & 1) << n;
  }
  return bits;
}

}  // namespace bki_mapping
