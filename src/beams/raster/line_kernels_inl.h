/// @file The innermost loop of line evidence; each instruction set's file includes it and gets a copy of its
/// own. Beams are traced through a box slice by slice, and added to the voxels that the kernel reaches there.
#pragma once

#include <algorithm>
#include <cmath>

#include "beams/raster/line_setup_inl.h"
#include "beams/raster/narrow_kernel_inl.h"
#include "beams/raster/pass_search_inl.h"
#include "beams/raster/slices_inl.h"
#include "beams/raster/wide_kernel_inl.h"

namespace bki_mapping {
namespace {

/// Adds the beams whose passes have been found.
template <BeamWeight kWeight>
void addBeams(const LineSetupArrays& beams, const BeamBox& box, GroupSums& sums) {
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
  const VecKernel kernel;
  WideKernelRaster<kWeight, kFew> few(kernel);
  WideKernelRaster<kWeight, kMany> many(kernel);
  float* arrays[3] = {};  // by the axis of rows
  NarrowKernelRaster<kWeight, 2> thin(kernel);
  NarrowKernelRaster<kWeight, 4> steep(kernel);
  for (std::size_t n = 0; n < sums.pass_count; ++n) {
    BeamPass pass = sums.passes[n];
    __builtin_prefetch(&beams.lines[sums.passes[n + kAhead].beam]);
    const LineSetup& line = beams.lines[pass.beam];
    const BoxSlices& slices = all[pass.slicing];
    if (distant) {
      slices.trim(line, pass);
      if (pass.first > pass.last) continue;
    }
    float*& array = arrays[slices.row_axis];
    if (!array) array = sums.open(slices.row_axis);
    const LineInBox beam = slices.at<kWeight>(line);
    if (slices.skew != 0) {
      const int count = pass.last - pass.first + 1;
      if (line.half_height <= 1.0f) {
        thin.add(beam, pass.first, count, slices.middle, array, slices.strides);
      } else {
        steep.add(beam, pass.first, count, slices.middle, array, slices.strides);
      }
      continue;
    }
    const WideReach reach(line);
    if (2 * reach.side < kFew * kOneVoxel) {
      addThickWhole(beam, reach, pass, few, array, slices.strides);
    } else {
      addThick(beam, reach, pass, layers[slices.axis], many, array, slices.strides);
    }
  }
  thin.flush();
  steep.flush();
}

template <BeamWeight kWeight>
void traceWeightedBeams(const LineSetupArrays& beams, const BeamRange* ranges, std::size_t count,
                        const BeamBox& box, GroupSums& sums) {
  sums.start(box.blocks);
  findPasses(beams, ranges, count, box, sums);
  addBeams<kWeight>(beams, box, sums);
}

void traceBeams(const LineSetupArrays& beams, const BeamRange* ranges, std::size_t count, const BeamBox& box,
                BeamWeight weight, GroupSums& sums) {
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
