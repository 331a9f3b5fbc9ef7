/// @file A beam on its way through a box; included by the inner loops alone.
#pragma once

#include <cmath>

#include "bki_mapping/inference/beam_tracks.h"
#include "lane_kernel.h"
#include "lane_weight.h"

namespace bki_mapping {
namespace {

/// From here on to its end at r = 1 the sparse kernel is below 1.1e-7, and is left out.
constexpr double kReachThatCounts = 0.974;

/// A beam's track with its kernel in LaneKernel's units, and rho less the weight's middle.
struct TracedBeam {
  float e_lane, e_row, g_row;
  float rho, rho_lane, rho_row, rho_slice;  ///< rho in the slice at hand
  std::int32_t step_lane, step_row;

  /// @param rho of the beam's place in the slice.
  TracedBeam(const BeamTrack& track, double rho_there) {
    const float scale = std::sqrt(LaneKernel::kScale);
    e_lane = track.e_lane * scale;
    e_row = track.e_row * scale;
    g_row = track.g_row * scale;
    rho = static_cast<float>(rho_there);
    rho_lane = track.rho_lane;
    rho_row = track.rho_row;
    rho_slice = static_cast<float>(track.rho_slice);
    step_lane = track.step_lane;
    step_row = track.step_row;
  }
};

}  // namespace
}  // namespace bki_mapping
