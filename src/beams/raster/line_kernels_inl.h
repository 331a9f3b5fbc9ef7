/// @file The loops over lines of beams: entry to this folder.
///
/// 1. line_setup_inl.h, once a scan: for each beam the slices it is swept through, its slopes there, and the
///    quadratic form of the distance from its line (LineSetup).
/// 2. pass_search_inl.h, for each group of blocks: which of the beams that BeamField::findRangesNear gives
///    pass through the group's box, and in which slices (BeamPass).
/// 3. slices_inl.h: the box in slices of each kind, and the line's position in its middle slice.
/// 4. For each pass, by how far the kernel reaches from the line (in findLines):
///      - narrow_kernel_inl.h, where sheared slices have the reach within one column: always where the
///        kernel is as long as a voxel or shorter, as by default. Two voxels of a column hold it, or four
///        where the line is steep along the column (half_height > 1). Lanes are slices.
///      - wide_kernel_inl.h, in straight slices, for longer kernels. Lanes are the voxels of a slice.
///    Both multiply the kernel by the weight, beam_weight_inl.h.
/// 5. GroupSums holds the sums of all beams, in rows along the axis that suits each kind of slice.
///
/// The narrow way exists because it evaluates the kernel only twice for a beam and a slice, whereas a
/// straight slice takes a whole vector for the three or four voxels that matter.
///
/// These files are included once for each instruction set, by files that cmake/kernels.cmake writes.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "beams/raster/line_setup_inl.h"
#include "beams/raster/narrow_kernel_inl.h"
#include "beams/raster/pass_search_inl.h"
#include "beams/raster/slices_inl.h"
#include "beams/raster/voxel_sums_inl.h"
#include "beams/raster/wide_kernel_inl.h"

namespace bki_mapping {
namespace {

/// Adds the beams whose passes have been found.
template <BeamWeight kWeight>
void addBeams(const LineSetupArrays& beams, const BeamBox& box, GroupSums& sums) {
  // Beyond this distance [voxels] the search, in single precision, also finds slices outside the box.
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
  // Reaches below two voxels get columns in fours. With columns in eights for all, kernels of 1.5 voxels cost
  // 17 % more (user time of map_sequence --threads 1, presets/robot.yaml, KITTI sequence 04, AVX-512); fours
  // whose heights are cut down to the blocks that matter cost as much more.
  constexpr int kFour = 4, kEight = kLanes < 8 ? kLanes : 8;
  const VecKernel kernel;
  WideKernelRaster<kWeight, kFour> fours(kernel);
  WideKernelRaster<kWeight, kEight> eights(kernel);
  float* arrays[3] = {};  // of sums, by the axis of rows
  NarrowKernelRaster<kWeight, 2> narrow(kernel);
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
    if (slices.shear != 0) {
      const int count = pass.last - pass.first + 1;
      if (line.half_height <= 1.0f) {
        narrow.add(beam, pass.first, count, slices.middle, array, slices.strides);
      } else {
        steep.add(beam, pass.first, count, slices.middle, array, slices.strides);
      }
      continue;
    }
    const WideReach reach(line);
    if (2 * reach.side < kFour * kOneVoxel) {
      addWideWhole(beam, reach, pass, fours, array, slices.strides);
    } else {
      addWide(beam, reach, pass, layers[slices.axis], eights, array, slices.strides);
    }
  }
  narrow.flush();
  steep.flush();
}

template <BeamWeight kWeight>
void traceWeightedBeams(const LineSetupArrays& beams, const BeamRange* ranges, std::size_t count,
                        const BeamBox& box, GroupSums& sums) {
  sums.start(box.blocks);
  findPasses(beams, ranges, count, box, sums);
  addBeams<kWeight>(beams, box, sums);
}

template <BeamWeight kWeight>
void weighWith(float* rho) {
  static_assert(kWeighed % kLanes == 0);
  for (std::size_t n = 0; n < kWeighed; n += kLanes) {
    StoreU(VecWeight<kWeight>::at(LoadU(rho + n) - VecWeight<kWeight>::kMiddle), rho + n);
  }
}

/// Calls a function with a weight as std::integral_constant.
template <typename Call>
void withWeight(BeamWeight weight, Call&& call) {
  switch (weight) {
    case BeamWeight::kUniform:
      return call(std::integral_constant<BeamWeight, BeamWeight::kUniform>());
    case BeamWeight::kLinear:
      return call(std::integral_constant<BeamWeight, BeamWeight::kLinear>());
    case BeamWeight::kBilinear:
      return call(std::integral_constant<BeamWeight, BeamWeight::kBilinear>());
  }
}

void traceBeams(const LineSetupArrays& beams, const BeamRange* ranges, std::size_t count, const BeamBox& box,
                BeamWeight weight, GroupSums& sums) {
  withWeight(weight,
             [&](auto w) { traceWeightedBeams<decltype(w)::value>(beams, ranges, count, box, sums); });
}

void weigh(BeamWeight weight, float* rho) {
  withWeight(weight, [&](auto w) { weighWith<decltype(w)::value>(rho); });
}

float sumAt(const SplitDirectionArrays& beams, const BeamRange* ranges, std::size_t count,
            const SplitPointDirection& voxel, float reach, BeamWeight weight) {
  float sum = 0.0f;
  withWeight(weight,
             [&](auto w) { sum = sumAtWith<decltype(w)::value>(beams, ranges, count, voxel, reach); });
  return sum;
}

constexpr LineKernels kLineKernels = {
    kInstructionSet, setUpLines, traceBeams,  weigh,       setUpDirections,
    sumAt,           findCells,  findWindows, findGreater, VecKernel::kScale};

}  // namespace
}  // namespace bki_mapping
