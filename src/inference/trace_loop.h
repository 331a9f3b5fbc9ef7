/// @file The innermost loop of line evidence; each instruction set's file includes it and gets a copy of its
/// own. Beams are traced through a box slice by slice, and added to the voxels that the kernel reaches there.
///
/// With p the offset of a voxel from the beam's place in its slice and w the beam's unit direction within the
/// slice, the voxel is off the beam's line by d^2 = |p|^2 - (w p)^2, and its rho greater by (w p) / length.
#pragma once

#include <algorithm>
#include <cmath>

#include "beam_search.h"
#include "bki_mapping/core/config.h"
#include "thick_beam.h"
#include "thin_beam.h"
#include "traced_beam.h"

namespace bki_mapping {
namespace {

/// A box as seen along one main axis.
struct BoxAxis {
  double first, lane, row;  ///< centre of its first voxel, relative to the sensor [voxels]
  float* sums = nullptr;    ///< where its sums begin, once there are any

  BoxAxis(const BeamBox& box, int axis)
      : first(box.first[axis]), lane(box.first[kLaneAxis[axis]]), row(box.first[kRowAxis[axis]]) {}

  /// Where a beam is in a slice, from the box's first voxel on [voxels].
  double laneOf(const BeamTrack& track, int slice) const { return (first + slice) * track.slope_lane - lane; }
  double rowOf(const BeamTrack& track, int slice) const { return (first + slice) * track.slope_row - row; }
  double rhoOf(const BeamTrack& track, int slice) const { return (first + slice) * track.rho_slice; }

  static std::int32_t place(double voxels) { return static_cast<std::int32_t>(voxels * kTrackVoxel); }

  /// Leaves out slices at both ends in which the beam is beside the box. @return whether any are left.
  bool trim(const BeamTrack& track, BeamPass& pass) const {
    const auto beside = [&](int slice) {
      const auto is = [](double at, float half) {
        return std::abs(at - BeamBox::kHalf) > BeamBox::kHalf + 1.0 + static_cast<double>(half);
      };
      return is(laneOf(track, slice), track.half_lane) || is(rowOf(track, slice), track.half_row);
    };
    while (pass.first <= pass.last && beside(pass.first)) ++pass.first;
    while (pass.first <= pass.last && beside(pass.last)) --pass.last;
    return pass.first <= pass.last;
  }
};

/// Calls add(pass, track, beam, axis) for the passes that have been found.
template <BeamWeight kWeight, typename Add>
[[gnu::always_inline]] inline void forEachPass(const BeamTrackArrays& beams, const BeamBox& box,
                                               GroupSums& sums, Add&& add) {
  // So far off the search, in single precision, names slices beside the box.
  constexpr double kDistant = 1e5;
  const bool distant = box.centre().cwiseAbs().maxCoeff() > kDistant;
  BoxAxis axes[3] = {{box, 0}, {box, 1}, {box, 2}};
  for (std::size_t n = 0; n < sums.pass_count; ++n) {
    BeamPass pass = sums.passes[n];
    const BeamTrack& track = beams.tracks[pass.beam];
    BoxAxis& axis = axes[track.axis];
    if (distant && !axis.trim(track, pass)) continue;
    if (!axis.sums) axis.sums = sums.open(track.axis);
    const double rho = axis.rhoOf(track, pass.first) - static_cast<double>(Weight<kWeight>::kMiddle);
    add(pass, track, TracedBeam(track, rho), axis);
  }
}

template <BeamWeight kWeight>
void addBeams(const BeamTrackArrays& beams, const BeamBox& box, GroupSums& sums) {
  const LaneKernel kernel;
  const ThinShape<2, 2> narrow;
  const ThinShape<2, 4> wide;
  const ThinShape<4, 4> full;
  const ThickShape thick;
  std::uint32_t layers[3][kGroupEdge];
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < kGroupEdge; ++k) layers[axis][k] = layerOf(box.blocks, axis, k);
  }
  forEachPass<kWeight>(
      beams, box, sums,
      [&](const BeamPass& pass, const BeamTrack& track, const TracedBeam& beam, const BoxAxis& axis) {
        // A slice is reached as far as its slant makes it.
        constexpr auto kNarrow = static_cast<float>(1.0 / kReachThatCounts), kThin = 2.0f * kNarrow;
        const double lane = axis.laneOf(track, pass.first), row = axis.rowOf(track, pass.first);
        if (std::max(track.half_lane, track.half_row) > kThin) {
          const auto half = [](float voxels) {
            return BoxAxis::place(static_cast<double>(voxels) * kReachThatCounts);
          };
          const ThickPlace place = {BoxAxis::place(lane), BoxAxis::place(row), half(track.half_lane),
                                    half(track.half_row)};
          addThick<kWeight>(beam, place, pass, layers[track.axis], thick, kernel,
                            axis.sums + GroupSums::kFirst);
          return;
        }
        const ThinPlace place(BoxAxis::place(lane + GroupSums::kPad), BoxAxis::place(row + GroupSums::kPad),
                              track);
        float* const at = axis.sums + pass.first * GroupSums::kSlice;
        const int slices = pass.last - pass.first + 1;
        if (track.half_row > kNarrow) {
          addThin<kWeight>(beam, place, slices, full, kernel, at);
        } else if (track.half_lane > kNarrow) {
          addThin<kWeight>(beam, place, slices, wide, kernel, at);
        } else {
          addThin<kWeight>(beam, place, slices, narrow, kernel, at);
        }
      });
}

template <BeamWeight kWeight>
void traceWeightedBeams(const BeamTrackArrays& beams, const BeamRange* ranges, std::size_t count,
                        const BeamBox& box, GroupSums& sums) {
  sums.start(box.blocks);
  findPasses(beams, ranges, count, box, sums);
  addBeams<kWeight>(beams, box, sums);
}

void traceBeamsLoop(const BeamTrackArrays& beams, const BeamRange* ranges, std::size_t count,
                    const BeamBox& box, BeamWeight weight, GroupSums& sums) {
  switch (weight) {
    case BeamWeight::kUniform:
      return traceWeightedBeams<BeamWeight::kUniform>(beams, ranges, count, box, sums);
    case BeamWeight::kLinear:
      return traceWeightedBeams<BeamWeight::kLinear>(beams, ranges, count, box, sums);
    case BeamWeight::kBilinear:
      return traceWeightedBeams<BeamWeight::kBilinear>(beams, ranges, count, box, sums);
  }
}

}  // namespace
}  // namespace bki_mapping
