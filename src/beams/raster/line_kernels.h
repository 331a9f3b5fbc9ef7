/// @file The loops over the lines of beams, compiled for each instruction set.
#pragma once

#include <cstddef>
#include <string>

#include "beams/beam_cells.h"
#include "beams/raster/group_sums.h"
#include "beams/raster/line_setup.h"
#include "beams/split_directions.h"
#include "bki_mapping/beams/beam_config.h"

namespace bki_mapping {

/// How many weights are computed at once.
constexpr std::size_t kWeighed = 64;

/// The loops for one instruction set. line_kernels_inl.h says how they work.
struct LineKernels {
  const char* instruction_set;
  /// Computes the lines of beams. @param beams from the sensor to their ends [m]. @param resolution [m].
  /// @param reach length of the kernel [voxels], at most VoxelKernel::kMaxReach.
  void (*set_up_lines)(const Eigen::Vector3f* beams, std::size_t count, double resolution, float reach,
                       const LineSetupTargets& to);
  /// Sets the sums of the blocks of a box that matter to those of w(rho) k(d) over the beams of some ranges,
  /// the kernel being sparse and of unit scale: d the distance to the beam's line, w the weight along it, 0
  /// unless 0 < rho < 1.
  /// @param beams set up by the same instruction set. @param sums with memory for all of them.
  void (*trace_beams)(const LineSetupArrays& beams, const BeamRange* ranges, std::size_t count,
                      const BeamBox& box, BeamWeight weight, GroupSums& sums);
  /// Replaces kWeighed projections rho by the weights there, as in trace_beams.
  void (*weigh)(BeamWeight weight, float* rho);
  /// Computes the directions of beams. @param beams, resolution as for set_up_lines.
  void (*set_up_directions)(const Eigen::Vector3f* beams, std::size_t count, double resolution,
                            const SplitDirectionTargets& to);
  /// The sum of w(rho) k(d) over the beams of some ranges at one voxel, which is not the sensor's own place.
  /// @param reach length of the kernel [voxels].
  float (*sum_at)(const SplitDirectionArrays& beams, const BeamRange* ranges, std::size_t count,
                  const SplitPointDirection& voxel, float reach, BeamWeight weight);
  /// Finds the direction bins of the 64 voxels of a layer of a block, and the squares of their distances
  /// [voxels^2]. @param first the coordinates of the first of them, from the sensor [voxels].
  void (*find_cells)(const float* first, std::int32_t* cells, float* distances2);
  /// Finds the direction bins of the lines that pass within `reach` [voxels] of voxels of a layer.
  void (*find_windows)(const float* first, float reach, CellWindows& windows);
  /// Of two arrays, the greater values, place by place. @param to neither of them.
  void (*find_greater)(const float* a, const float* b, int count, float* to);
  float kernel_scale;  ///< lines measure distances in lengths of the kernel / sqrt(kernel_scale)
};

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const LineKernels& lineKernelsFor(const std::string& instruction_set);

}  // namespace bki_mapping
