/// @file Computes LineSetups from beams. Plain loops over arrays, which compilers turn into vector
/// instructions. Part of line_kernels_inl.h.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "beams/raster/line_setup.h"
#include "kernel/vec_kernel_inl.h"

namespace bki_mapping {
namespace {

/// Some beams as arrays.
struct LineBatch {
  static constexpr std::size_t kMost = 64;

  std::int32_t axis[kMost];                             ///< main axes
  float end[kMost];                                     ///< of the beam along its main axis [m]
  double slope_side[kMost], slope_height[kMost];        ///< by step along the main axis, as rho below
  float rho[kMost];                                     ///< change of rho by that step
  std::int32_t slicing[kMost];                          ///< as BeamSlicing numbers them
  double by_slice_side[kMost], by_slice_height[kMost];  ///< slopes by step from slice to slice
  // As in LineSetup:
  std::int32_t step_side[kMost], step_height[kMost];
  float rho_slice[kMost], e_side[kMost], e_height[kMost], g_height[kMost], rho_side[kMost], rho_height[kMost],
      half_side[kMost], half_height[kMost];
};

/// A beam without length has no direction, and reaches nothing: its rho is 0 everywhere.
void takeCourses(const Eigen::Vector3f* beams, std::size_t count, double resolution, LineBatch& batch) {
  constexpr float kShortest = 1e-9f;  // [m]
  for (std::size_t n = 0; n < count; ++n) {
    const float x = beams[n].x(), y = beams[n].y(), z = beams[n].z();
    const float size_x = std::abs(x), size_y = std::abs(y), size_z = std::abs(z);
    const bool is_y = size_y > size_x, is_z = size_z > (is_y ? size_y : size_x);
    const float end = is_z ? z : is_y ? y : x;
    const bool is_beam = std::abs(end) >= kShortest;
    static_assert(kSideAxis[0] == 1 && kSideAxis[1] == 0 && kSideAxis[2] == 1);
    static_assert(kHeightAxis[0] == 2 && kHeightAxis[1] == 2 && kHeightAxis[2] == 0);
    const double inverse = is_beam ? 1.0 / static_cast<double>(is_beam ? end : 1.0f) : 0.0;
    batch.axis[n] = is_z ? 2 : is_y ? 1 : 0;
    batch.end[n] = end;
    batch.slope_side[n] = static_cast<double>(!is_z && is_y ? x : y) * inverse;
    batch.slope_height[n] = static_cast<double>(is_z ? x : z) * inverse;
    batch.rho[n] = static_cast<float>(resolution * inverse);
  }
}

/// In sheared slices, where one column of each and four voxels of that hold the kernel; else in straight
/// ones.
/// @param reach of the kernel [voxels].
///
/// Let v lead from a slice's column to the next, n stand across slices (v = (0, 1), n = (1, 0) in straight
/// ones, v = (1, -2 shear), n = (2, shear) in sheared ones, along the main and side axes), h along columns, u
/// be the unit direction. A position p = a v + b h is off the line by d^2 = |p|^2 - (u p)^2 = A a^2 + 2 B a b
/// + C b^2, whose determinant is A C - B^2 = (u n)^2; its factors by Cholesky, a first, are e and g. Within d
/// = 1 are positions up to |a| = sqrt(C) / (u n) and |b| = sqrt(A) / (u n). Slopes are multiplied by the size
/// of a box, and therefore in double precision.
void findLines(std::size_t count, float reach, LineBatch& batch) {
  const float counts = reach * static_cast<float>(kReachThatCounts), counts2 = counts * counts;
  const float by_reach = VecKernel::unit() / reach;
  for (std::size_t n = 0; n < count; ++n) {
    const auto s = static_cast<float>(batch.slope_side[n]), t = static_cast<float>(batch.slope_height[n]);
    const float side = 1.0f + s * s, sheared_slices = 2.0f + std::abs(s),
                squared = sheared_slices * sheared_slices;
    // Squares of how far the kernel reaches in sheared slices, times (2 + |s|)^2. Where a is up to 0.5, b is
    // below 2.
    const float a2 = counts2 * side, b2 = counts2 * (squared + 5.0f * t * t);
    const bool is_sheared = a2 <= 0.25f * squared;
    batch.slicing[n] = BeamSlicing{batch.axis[n], !is_sheared ? 0 : s < 0.0f ? -1 : 1}.number();

    // Slices by step along the main axis.
    const double by_slice = is_sheared ? 1.0 / (2.0 + std::abs(batch.slope_side[n])) : 1.0;
    const double slope_side = is_sheared ? by_slice : batch.slope_side[n],
                 slope_height = batch.slope_height[n] * by_slice;
    batch.by_slice_side[n] = slope_side;
    batch.by_slice_height[n] = slope_height;
    batch.rho_slice[n] = batch.rho[n] * static_cast<float>(by_slice);
    const auto steps = [](double slope) {
      return static_cast<std::int32_t>(slope * kOneVoxel + (slope < 0.0 ? -0.5 : 0.5));  // rounded
    };
    batch.step_side[n] = steps(slope_side);
    batch.step_height[n] = steps(slope_height);

    const float uu = 1.0f / (side + t * t);                            // u along the main axis, squared
    const float v_along = is_sheared ? 1.0f - 2.0f * std::abs(s) : s;  // u v is that times u
    const float across = is_sheared ? squared : 1.0f;                  // (u n)^2 is that times u^2
    const float a = (is_sheared ? 5.0f : 1.0f) - uu * v_along * v_along, by_a = 1.0f / a;
    const float e_side = std::sqrt(a) * by_reach, rho = batch.rho[n] * uu;
    batch.e_side[n] = e_side;
    batch.e_height[n] = -uu * v_along * t * by_a * e_side;
    batch.g_height[n] = std::sqrt(uu * across * by_a) * by_reach;
    batch.rho_side[n] = v_along * rho;
    batch.rho_height[n] = t * rho;
    batch.half_side[n] = is_sheared ? 0.5f : counts * std::sqrt(side);
    batch.half_height[n] = is_sheared ? std::sqrt(b2 / squared) : counts * std::sqrt(1.0f + t * t);
  }
}

/// Writes up to kLanes setups, the batch's from `first` on.
inline void writeLines(const LineBatch& batch, std::size_t first, std::size_t count, LineSetup* to) {
  const auto ints = [&](const float* from) { return BitCast<IntVec>(LoadU(from + first)); };
  const auto whole = [&](const std::int32_t* from) { return LoadU(from + first); };
  alignas(64) std::int32_t fours[3][4 * kLanes];
  StoreInterleaved4(
      {whole(batch.step_side), whole(batch.step_height), ints(batch.e_side), ints(batch.e_height)}, fours[0]);
  StoreInterleaved4(
      {ints(batch.g_height), ints(batch.rho_side), ints(batch.rho_height), ints(batch.rho_slice)}, fours[1]);
  // Not IntVec{}: GCC 9 does not take that here.
  StoreInterleaved4({ints(batch.half_side), ints(batch.half_height), whole(batch.slicing), Set(0)}, fours[2]);
  static_assert(offsetof(LineSetup, step_side) == 16 && offsetof(LineSetup, g_height) == 32 &&
                offsetof(LineSetup, half_side) == 48 && offsetof(LineSetup, slicing) == 56);
  for (std::size_t n = 0; n < count; ++n) {
    to[n].slope_side = batch.by_slice_side[first + n];
    to[n].slope_height = batch.by_slice_height[first + n];
    for (std::size_t k = 0; k < 3; ++k) {
      __builtin_memcpy(reinterpret_cast<unsigned char*>(to + n) + 16 * (k + 1),
                       fours[k] + Interleaved4(static_cast<int>(n)), 16);
    }
  }
}

void setUpLines(const Eigen::Vector3f* beams, std::size_t count, double resolution, float reach,
                const LineSetupTargets& to) {
  const auto per_metre = static_cast<float>(1.0 / resolution);
  LineBatch batch = {};
  for (std::size_t begin = 0; begin < count; begin += LineBatch::kMost) {
    const std::size_t some = std::min(count - begin, LineBatch::kMost);
    takeCourses(beams + begin, some, resolution, batch);
    findLines(some, reach, batch);
    for (std::size_t n = 0; n < some; ++n) {
      to.axis[begin + n] = batch.axis[n];
      to.slope_side[begin + n] = static_cast<float>(batch.slope_side[n]);
      to.slope_height[begin + n] = static_cast<float>(batch.slope_height[n]);
      to.end[begin + n] = batch.end[n] * per_metre;
      to.shear[begin + n] = static_cast<float>(BeamSlicing::of(batch.slicing[n]).shear);
    }
    for (std::size_t n = 0; n < some; n += kLanes) {
      writeLines(batch, n, std::min<std::size_t>(some - n, kLanes), to.lines + begin + n);
    }
  }
}

}  // namespace
}  // namespace bki_mapping
