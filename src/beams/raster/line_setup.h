/// @file Where each beam runs in its slices: what raster loops need to know of its line, computed once a
/// scan.
#pragma once

#include <cstdint>
#include <vector>

#include "beams/beams.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// A slice is the set of voxels in one position of a sweep plane: the plane moves along the beam, and in each
/// slice the line of the beam has one position. The main axis is that along which the beam runs most; columns
/// of voxels lie along the height axis, and columns are counted along the side axis.
constexpr int kSideAxis[3] = {1, 0, 1}, kHeightAxis[3] = {2, 2, 0};

/// Straight slices are perpendicular to the main axis; their columns are 1 voxel apart. Sheared slices stand
/// oblique, as in shear-warp volume rendering: 2 main + shear side is the same for all voxels of a slice.
/// Their columns are sqrt(5) voxels apart, so that a narrow kernel reaches only one of them. Columns of
/// straight slices are counted by their side, columns of sheared slices by their main coordinate.
struct BeamSlicing {
  static constexpr int kCount = 9;

  int axis;   ///< the main axis
  int shear;  ///< 1 or -1, or 0: straight

  constexpr int number() const { return axis + 3 * (shear == 0 ? 0 : shear > 0 ? 1 : 2); }
  static constexpr BeamSlicing of(int number) { return {number % 3, number < 3 ? 0 : number < 6 ? 1 : -1}; }
};

/// Positions in a slice are also stored in fixed point, with this many fractional bits. With a kernel of up
/// to VoxelKernel::kMaxReach what is computed with them stays below 256 voxels.
constexpr int kPositionBits = 23;
constexpr std::int32_t kOneVoxel = 1 << kPositionBits;

/// From this fraction of its length on, the sparse kernel is below 1.1e-7, and is left out.
constexpr double kReachThatCounts = 0.974;

/// The line of a beam in its slices. Lengths are in voxels unless stated otherwise; `side` counts columns
/// of the slice, `height` voxels of a column.
struct alignas(64) LineSetup {
  double slope_side, slope_height;      ///< steps from slice to slice
  std::int32_t step_side, step_height;  ///< the slopes in fixed point
  /// A position in the slice that is (side, height) from the line is off it by the length of the vector
  /// (e_side side + e_height height, g_height height) [lengths of the kernel /
  /// sqrt(LineKernels::kernel_scale)]; rho is greater there by rho_side side + rho_height height.
  float e_side, e_height, g_height, rho_side, rho_height;
  float rho_slice;               ///< change of rho from slice to slice
  float half_side, half_height;  ///< distance from the line, within a slice, up to which the kernel counts
  std::int32_t slicing;          ///< as BeamSlicing numbers them
};

/// The beams of a scan as arrays. Loops may read up to kBeamPadding elements past the end, except of `lines`.
struct LineSetupArrays {
  const std::int32_t* axis;                ///< main axes
  const float *slope_side, *slope_height;  ///< along the side and height axes, by step along the main axis
  const float* end;                        ///< of the beam along its main axis, from the sensor [voxels]
  const float* shear;                      ///< of the slices
  const LineSetup* lines;
};

/// The same, to be written.
struct LineSetupTargets {
  std::int32_t* axis;
  float *slope_side, *slope_height, *end, *shear;
  LineSetup* lines;
};

struct LineKernels;

/// The lines of a scan's beams. Keeps its memory from scan to scan.
class LineSetups {
 public:
  /// Replaces the beams. @param length of the kernel [m]. @param kernels the same that will read the lines
  /// later.
  void set(const Beams& beams, double resolution, double length, const LineKernels& kernels,
           ThreadPool& pool);

  /// Takes one of so many lines of others. @param count of the others.
  void setEvery(std::size_t one_of, const LineSetups& others, std::size_t count);

  LineSetupArrays arrays() const {
    return {axis_.data(), slope_side_.data(), slope_height_.data(),
            end_.data(),  shear_.data(),      lines_.data()};
  }

 private:
  std::vector<std::int32_t> axis_;
  std::vector<float> slope_side_, slope_height_, end_, shear_;
  std::vector<LineSetup> lines_;
};

}  // namespace bki_mapping
