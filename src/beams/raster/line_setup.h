/// @file Where each beam runs in its slices: what raster loops need to know of its line, computed once a
/// scan.
#pragma once

#include <cstdint>
#include <vector>

#include "beams/beams.h"
#include "beams/raster/beam_slicing.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

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
