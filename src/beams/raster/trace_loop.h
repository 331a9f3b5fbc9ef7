/// @file The innermost loop of line evidence; each instruction set's file includes it and gets a copy of its
/// own. Beams are traced through a box slice by slice, and added to the voxels that the kernel reaches there.
#pragma once

#include <algorithm>
#include <cmath>

#include "beams/raster/beam_search.h"
#include "beams/raster/thick_beam.h"
#include "beams/raster/thin_beam.h"
#include "beams/raster/traced_beam.h"
#include "bki_mapping/beams/beam_config.h"

namespace bki_mapping {
namespace {

/// A box cut into slices of one kind.
struct alignas(64) BoxSlices {
  double first, side, height;  ///< the slice, side and height of its first voxel, from the sensor on
  double middle_first;         ///< the middle slice, from the sensor on
  int middle;                  ///< its number
  SliceStrides strides;
  int row_axis;  ///< of the sums
  int axis, skew;

  BoxSlices(const BeamBox& box, BeamSlicing slicing) : axis(slicing.axis), skew(slicing.skew) {
    const int side_axis = kSideAxis[axis], height_axis = kHeightAxis[axis];
    const double main = box.first[axis], beside = box.first[side_axis];
    first = skew == 0 ? main : 2.0 * main + skew * beside;
    side = skew == 0 ? beside : main;
    height = box.first[height_axis];
    row_axis = skew == 0 ? side_axis : height_axis;
    middle = skew == 0 ? kMiddleSlice : kMiddleSkewSlice[skew + 1];
    middle_first = first + middle;
    const auto stride = [&](int of) { return GroupSums::stride(row_axis, of); };
    strides = {stride(axis), stride(side_axis), stride(height_axis)};
    if (skew != 0) {
      strides.slice = skew * stride(side_axis);
      strides.side = stride(axis) - 2 * skew * stride(side_axis);
    }
  }

  /// A beam in the middle slice.
  template <BeamWeight kWeight>
  [[gnu::always_inline]] TracedBeam traced(const BeamTrack& track) const {
    return {track, static_cast<float>(middle_first) * track.rho_slice - Weight<kWeight>::kMiddle,
            TracedBeam::place(middle_first * track.slope_side - side),
            TracedBeam::place(middle_first * track.slope_height - height)};
  }

  /// Where a beam is in a slice, from the box's first voxel on.
  double sideOf(const BeamTrack& track, int slice) const { return (first + slice) * track.slope_side - side; }
  double heightOf(const BeamTrack& track, int slice) const {
    return (first + slice) * track.slope_height - height;
  }

  /// Leaves out slices at both ends in which the beam is beside the box.
  void trim(const BeamTrack& track, BeamPass& pass) const {
    const auto beside = [](double at, double half) {
      return std::abs(at - BeamBox::kHalf) > BeamBox::kHalf + 1.0 + half;
    };
    const auto away = [&](int slice) {
      const double at = sideOf(track, slice);
      if (beside(heightOf(track, slice), static_cast<double>(track.half_height))) return true;
      if (skew == 0) return beside(at, static_cast<double>(track.half_side));
      return beside(at, 0.5) || beside(skew * (slice - 2.0 * at), 2.0);
    };
    while (pass.first <= pass.last && away(pass.first)) ++pass.first;
    while (pass.first <= pass.last && away(pass.last)) --pass.last;
  }
};

/// Adds the beams whose passes have been found.
template <BeamWeight kWeight>
void addBeams(const BeamTrackArrays& beams, const BeamBox& box, GroupSums& sums) {
  // So far off the search, in single precision, names slices beside the box.
  constexpr double kDistant = 1e5;
  const bool distant = box.centre().cwiseAbs().maxCoeff() > kDistant;
  constexpr auto kSlicing = BeamSlicing::of;
  const BoxSlices all[BeamSlicing::kCount] = {{box, kSlicing(0)}, {box, kSlicing(1)}, {box, kSlicing(2)},
                                              {box, kSlicing(3)}, {box, kSlicing(4)}, {box, kSlicing(5)},
                                              {box, kSlicing(6)}, {box, kSlicing(7)}, {box, kSlicing(8)}};
  std::uint32_t layers[3][kGroupEdge];
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < kGroupEdge; ++k) layers[axis][k] = layerOf(box.blocks, axis, k);
  }
  constexpr int kFew = 4, kMany = kLanes < 8 ? kLanes : 8;
  const LaneKernel kernel;
  ThickVectors<kWeight, kFew> few(kernel);
  ThickVectors<kWeight, kMany> many(kernel);
  float* arrays[3] = {};  // by the axis of rows
  ThinSlices<kWeight, 2> thin(kernel);
  ThinSlices<kWeight, 4> steep(kernel);
  for (std::size_t n = 0; n < sums.pass_count; ++n) {
    BeamPass pass = sums.passes[n];
    __builtin_prefetch(&beams.tracks[sums.passes[n + kAhead].beam]);
    const BeamTrack& track = beams.tracks[pass.beam];
    const BoxSlices& slices = all[pass.slicing];
    if (distant) {
      slices.trim(track, pass);
      if (pass.first > pass.last) continue;
    }
    float*& array = arrays[slices.row_axis];
    if (!array) array = sums.open(slices.row_axis);
    const TracedBeam beam = slices.traced<kWeight>(track);
    if (slices.skew != 0) {
      const int count = pass.last - pass.first + 1;
      if (track.half_height <= 1.0f) {
        thin.add(beam, pass.first, count, slices.middle, array, slices.strides);
      } else {
        steep.add(beam, pass.first, count, slices.middle, array, slices.strides);
      }
      continue;
    }
    const ThickReach reach(track);
    if (2 * reach.side < kFew * kTrackVoxel) {
      addThickWhole(beam, reach, pass, few, array, slices.strides);
    } else {
      addThick(beam, reach, pass, layers[slices.axis], many, array, slices.strides);
    }
  }
  thin.flush();
  steep.flush();
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
