/// @file How far the beams reach that may pass near a point.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "beams/beam_cells.h"
#include "beams/beam_field.h"
#include "beams/raster/line_kernels.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// For shells about the sensor, the greatest length of the beams whose lines pass within reach of any point
/// of a shell in a direction bin. No beam reaches a point that is farther away. Keeps its memory from scan to
/// scan.
class LongestBeams {
 public:
  /// @param reach of the kernel [voxels]. @param farthest distance that is asked for [voxels]; takes a byte
  /// for each square voxel of a square with this edge.
  void set(const BeamField& field, float reach, float farthest, const LineKernels& kernels, ThreadPool& pool);

  /// An upper bound for the lengths of the beams that reach a point [voxels]; 0: none passes. @param cell
  /// direction bin of the point. @param distance2 the square of its distance from the sensor [voxels^2].
  float at(std::int32_t cell, float distance2) const {
    constexpr float kUnknown = std::numeric_limits<float>::infinity();
    if (!(distance2 < static_cast<float>(shell_at_.size()))) return kUnknown;
    const std::uint8_t shell = shell_at_[static_cast<std::size_t>(distance2)];
    if (shell == kNone) return kUnknown;
    const Shell& of = shells_[shell];
    return cell < of.first || cell > of.last ? 0.0f : of.lengths[cell >> of.shift];
  }

 private:
  static constexpr std::uint8_t kNone = 0xff;
  static constexpr int kLevels = 8;
  static_assert(1 << (kLevels - 1) == kBeamRows);

  /// The bins of a row, some side by side taken together.
  struct Grid {
    int shift, columns;
    /// The greatest length in each bin [voxels]. Level n holds, for each row, that of the row and the
    /// 2^n - 1 after it.
    std::array<std::vector<float>, kLevels> levels;

    std::size_t at(int row) const { return static_cast<std::size_t>(row * columns); }
  };
  struct Shell {
    float begin;          ///< [voxels]
    double sine, cosine;  ///< of the angle that the reach subtends at most
    const Grid* grid;
    int shift;
    std::int32_t first, last;  ///< direction bins of the first and the last row that beams pass
    float* lengths;
  };
  struct Rows {
    int first, last;
  };

  void findLengths(const BeamField& field, ThreadPool& pool);
  void placeShells(float reach, float farthest);
  /// The rows with beams that pass a row of a shell; none if `first` is after `last`.
  Rows rowsNear(int row, const Shell& shell) const;
  /// Sets the levels of a grid that windows of some rows need.
  void setLevels(double rows, Grid& grid, const LineKernels& kernels, ThreadPool& pool) const;
  void setRow(int row, const Shell& shell, const LineKernels& kernels) const;

  Grid fine_ = {0, kBeamColumns, {}}, coarse_ = {3, kBeamColumns >> 3, {}};
  Rows with_beams_ = {0, -1};
  std::vector<Shell> shells_;
  std::vector<std::uint8_t> shell_at_;  ///< by the square of the distance, rounded down
  std::vector<float> memory_;           ///< of the shells' lengths
};

}  // namespace bki_mapping
