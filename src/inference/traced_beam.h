/// @file A beam on its way through a box; included by the inner loops alone.
#pragma once

#include <cmath>

#include "bki_mapping/inference/beam_tracks.h"
#include "lane_kernel.h"
#include "lane_weight.h"

namespace bki_mapping {
namespace {

/// The slice of a box in which a beam's place is found; from there it goes by steps. So a beam's value at a
/// voxel does not depend on where its pass begins.
constexpr int kMiddleSlice = kGroupVoxels / 2, kMiddleSkewSlice[3] = {15, 0, 46};  ///< -1 and 1: by skew + 1

/// A beam's track with its kernel in LaneKernel's units, and rho less the weight's middle.
struct TracedBeam {
  float e_side, e_height, g_height;
  float rho, rho_side, rho_height, rho_slice;  ///< rho of the beam's place in the middle slice
  std::int32_t side, height;  ///< that place, from the group's first voxel on [1 / kTrackVoxel]
  std::int32_t step_side, step_height;

  /// @param rho_there, side_there, height_there in the slice [voxels].
  TracedBeam(const BeamTrack& track, double rho_there, double side_there, double height_there) {
    const float scale = std::sqrt(LaneKernel::kScale);
    e_side = track.e_side * scale;
    e_height = track.e_height * scale;
    g_height = track.g_height * scale;
    rho = static_cast<float>(rho_there);
    rho_side = track.rho_side;
    rho_height = track.rho_height;
    rho_slice = static_cast<float>(track.rho_slice);
    side = place(side_there);
    height = place(height_there);
    step_side = track.step_side;
    step_height = track.step_height;
  }

  static std::int32_t place(double voxels) { return static_cast<std::int32_t>(voxels * kTrackVoxel); }
};

/// From one slice's voxels to the next's, and along the side and height axes in a slice [floats].
struct SliceStrides {
  int slice, side, height;
};

}  // namespace
}  // namespace bki_mapping
