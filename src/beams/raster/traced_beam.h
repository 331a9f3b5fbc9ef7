/// @file A beam on its way through a box; included by the inner loops alone.
#pragma once

#include "beams/raster/beam_tracks.h"
#include "beams/raster/lane_weight.h"
#include "kernel/lane_kernel.h"

namespace bki_mapping {
namespace {

/// The slice of a box in which a beam's place is found; from there it goes by steps. So a beam's value at a
/// voxel does not depend on where its pass begins.
constexpr int kMiddleSlice = kGroupVoxels / 2, kMiddleSkewSlice[3] = {15, 0, 46};  ///< -1 and 1: by skew + 1

/// A beam's track, and its place in the middle slice.
struct TracedBeam {
  const BeamTrack& track;
  float rho;                  ///< less the weight's middle
  std::int32_t side, height;  ///< from the group's first voxel on [1 / kTrackVoxel]

  static std::int32_t place(double voxels) { return static_cast<std::int32_t>(voxels * kTrackVoxel); }
};

/// From one slice's voxels to the next's, and along the side and height axes in a slice [floats].
struct SliceStrides {
  int slice, side, height;
};

}  // namespace
}  // namespace bki_mapping
