/// @file A box cut into slices, and a line in them; part of line_kernels_inl.h.
#pragma once

#include <cmath>
#include <cstdint>

#include "beams/raster/beam_box.h"
#include "beams/raster/beam_weight_inl.h"
#include "beams/raster/group_sums.h"
#include "beams/raster/line_setup.h"

namespace bki_mapping {
namespace {

/// The slice of a box in which a line's position is computed. Other slices are reached from it in steps, so
/// that what a beam adds to a voxel does not depend on the slice where its pass begins.
constexpr int kMiddleSlice = kGroupVoxels / 2,
              kMiddleShearedSlice[3] = {15, 0, 46};  ///< -1 and 1: by shear + 1

[[gnu::always_inline]] inline std::int32_t toFixedPoint(double voxels) {
  return static_cast<std::int32_t>(voxels * kOneVoxel);
}

/// The line of a beam, and its position in the middle slice of a box.
struct LineInBox {
  const LineSetup& line;
  float rho;                  ///< minus VecWeight::kMiddle
  std::int32_t side, height;  ///< from the group's first voxel, in fixed point
};

/// Distances in memory [floats]: from a voxel to the same one in the next slice, and along the side and
/// height axes within a slice.
struct SliceStrides {
  int slice, side, height;
};

/// A box cut into slices of one kind.
struct alignas(64) BoxSlices {
  double first, side, height;  ///< the slice, side and height of its first voxel, from the sensor
  double middle_first;         ///< the middle slice, from the sensor
  int middle;                  ///< the middle slice, from the box's first
  SliceStrides strides;
  int row_axis;  ///< of the sums
  int axis, shear;

  BoxSlices(const BeamBox& box, BeamSlicing slicing) : axis(slicing.axis), shear(slicing.shear) {
    const int side_axis = kSideAxis[axis], height_axis = kHeightAxis[axis];
    const double main = box.first[axis], beside = box.first[side_axis];
    first = shear == 0 ? main : 2.0 * main + shear * beside;
    side = shear == 0 ? beside : main;
    height = box.first[height_axis];
    row_axis = shear == 0 ? side_axis : height_axis;
    middle = shear == 0 ? kMiddleSlice : kMiddleShearedSlice[shear + 1];
    middle_first = first + middle;
    const auto stride = [&](int of) { return GroupSums::stride(row_axis, of); };
    strides = {stride(axis), stride(side_axis), stride(height_axis)};
    if (shear != 0) {
      strides.slice = shear * stride(side_axis);
      strides.side = stride(axis) - 2 * shear * stride(side_axis);
    }
  }

  /// A line in the middle slice.
  template <BeamWeight kWeight>
  [[gnu::always_inline]] LineInBox at(const LineSetup& line) const {
    return {line, static_cast<float>(middle_first) * line.rho_slice - VecWeight<kWeight>::kMiddle,
            toFixedPoint(middle_first * line.slope_side - side),
            toFixedPoint(middle_first * line.slope_height - height)};
  }

  /// Where a line is in a slice, from the box's first voxel.
  double sideOf(const LineSetup& line, int slice) const { return (first + slice) * line.slope_side - side; }
  double heightOf(const LineSetup& line, int slice) const {
    return (first + slice) * line.slope_height - height;
  }

  /// Leaves out slices at both ends in which the line is beside the box.
  void trim(const LineSetup& line, BeamPass& pass) const {
    const auto beside = [](double at, double half) {
      return std::abs(at - BeamBox::kHalf) > BeamBox::kHalf + 1.0 + half;
    };
    const auto away = [&](int slice) {
      const double at = sideOf(line, slice);
      if (beside(heightOf(line, slice), static_cast<double>(line.half_height))) return true;
      if (shear == 0) return beside(at, static_cast<double>(line.half_side));
      return beside(at, 0.5) || beside(shear * (slice - 2.0 * at), 2.0);
    };
    while (pass.first <= pass.last && away(pass.first)) ++pass.first;
    while (pass.first <= pass.last && away(pass.last)) --pass.last;
  }
};

}  // namespace
}  // namespace bki_mapping
