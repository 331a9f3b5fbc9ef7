/// @file Line evidence voxel by voxel, for octants near which there are many beams; included by beam_loop.h
/// alone. Each voxel takes the slices of the table that its own ball covers: most of the beams in them reach
/// it, and none has to be picked.
#pragma once

#include "beam_window.h"
#include "bki_mapping/inference/beam_cells.h"
#include "lane_kernel.h"
#include "lane_weight.h"
#include "lanes.h"

namespace bki_mapping {
namespace {

/// With so many beams in its window an octant is better added voxel by voxel, measured at 0.3 m; with less
/// the rows of the table that a voxel covers hold too few each.
constexpr std::uint32_t kManyBeams = 1000;

/// The voxels of an octant.
constexpr int kOctantVoxels = 64;

struct OctantVoxels {
  std::int32_t cx[kOctantVoxels], cy[kOctantVoxels], cz[kOctantVoxels];  ///< directions [kDirectionStep]
  float r[kOctantVoxels];                                                ///< distances from the sensor [m]
  Windows<kOctantVoxels> windows;
};

/// The place of an octant's n-th voxel in its block.
[[gnu::always_inline]] inline int voxelInOctant(int octant, int n) {
  const int i = 4 * (octant & 1) + (n & 3), j = 4 * (octant >> 1 & 1) + (n >> 2 & 3),
            k = 4 * (octant >> 2) + (n >> 4);
  return i + kBlockEdge * (j + kBlockEdge * k);
}

void findVoxels(const BeamBlock& block, int octant, OctantVoxels& voxels) {
  const float l = block.length * 1.0001f;
  for (int n = 0; n < kOctantVoxels; ++n) {
    const Centre c = centreOf<kBlockEdge>(block, voxelInOctant(octant, n));
    const double r2 = c.x * c.x + c.y * c.y + c.z * c.z;
    const double r = std::sqrt(r2 > 1e-12 ? r2 : 1e-12), steps = 1.0 / (r * kDirectionStep);
    voxels.r[n] = static_cast<float>(r);
    voxels.cx[n] = static_cast<std::int32_t>(c.x * steps);
    voxels.cy[n] = static_cast<std::int32_t>(c.y * steps);
    voxels.cz[n] = static_cast<std::int32_t>(c.z * steps);
    findWindow(static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z), l, n,
               voxels.windows);
  }
}

/// Adds the beams near the voxels of an octant.
template <BeamWeight kWeight>
void addOctantByVoxels(const BeamArrays& beams, const BeamBlock& block, int octant, float* sums) {
  OctantVoxels voxels;
  findVoxels(block, octant, voxels);
  const LaneKernel kernel;
  const float inverse_length2 = 1.0f / (block.length * block.length);
  for (int n = 0; n < kOctantVoxels; ++n) {
    const std::int32_t cx = voxels.cx[n], cy = voxels.cy[n], cz = voxels.cz[n];
    const float r = voxels.r[n];
    // 1 - cos is kHalf times the squared chord of directions, and d^2 = r^2 (1 - cos) (2 - (1 - cos)).
    constexpr float kHalf = kDirectionStep * kDirectionStep * 0.5f;
    const float scale = LaneKernel::kScale * r * r * inverse_length2 * kHalf;
    FloatLanes sum = {};
    forEachRange(beams.begin, voxels.windows, n, [&](BeamRange range) {
      for (std::uint32_t b = range.first; b < range.last; b += kLanes) {
        const FloatLanes dx = toFloat(cx - load(beams.ux + b)), dy = toFloat(cy - load(beams.uy + b)),
                         dz = toFloat(cz - load(beams.uz + b));
        const FloatLanes chord2 = dx * dx + dy * dy + dz * dz;
        const FloatLanes t = chord2 * (2.0f * scale - scale * kHalf * chord2) + LaneKernel::kShift;
        // Without an inverse length beams have no weight.
        const FloatLanes inverse_length =
            loadFirst(static_cast<std::int32_t>(range.last - b), beams.inverse_length + b);
        const FloatLanes rho = (r - r * kHalf * chord2) * inverse_length - Weight<kWeight>::kMiddle;
        sum += Weight<kWeight>::at(rho) * kernel(t);
      }
    });
    sums[voxelInOctant(octant, n)] += sumOf<kLanes>(reinterpret_cast<const float*>(&sum));
  }
}

}  // namespace
}  // namespace bki_mapping
