/// @file Sums over beams at the voxels of a group of blocks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "beams/raster/beam_box.h"

namespace bki_mapping {

/// Sums of the sparse kernel over beams: three arrays of the group's voxels, which differ in the axis along
/// which voxels are adjacent in memory. Padding around the group receives what loops add outside it.
class GroupSums {
 public:
  static constexpr int kPad = 8;                                           ///< voxels before and after a row
  static constexpr int kBeside = 6;                                        ///< rows on each side
  static constexpr int kRow = kGroupVoxels + 2 * kPad;                     ///< from row to row
  static constexpr int kPlane = (kGroupVoxels + 2 * kBeside) * kRow + 16;  ///< an odd number of cache lines
  static constexpr int kArray = (kGroupVoxels + 2 * kBeside) * kPlane;     ///< all rows along an axis
  static constexpr int kFirst = kBeside * kPlane + kBeside * kRow + kPad;  ///< the group's first voxel

  /// From voxel to voxel along an axis, in the array of a row axis.
  static constexpr int stride(int row_axis, int axis) {
    return axis == row_axis ? 1 : axis == (row_axis == 0 ? 1 : 0) ? kRow : kPlane;
  }

  GroupSums() = default;
  GroupSums(const GroupSums&) = delete;  // it points into its own memory, which a move takes along
  GroupSums& operator=(const GroupSums&) = delete;
  GroupSums(GroupSums&&) = default;
  GroupSums& operator=(GroupSums&&) = default;

  /// Forgets all sums. @param blocks that matter; sums of others are undefined.
  void start(std::uint64_t blocks);
  /// Sets the array of a row axis to 0. To be called before the array is used. @return the group's first
  /// voxel there.
  float* open(int row_axis);
  /// Sets `sums` to those of a block that matters, times the scale. @param position coordinates of the block
  /// in the group [blocks]. @return whether any of them is above 0.
  bool sumsOf(const std::array<int, 3>& position, float scale, float* sums) const;
  /// Allocates all memory that sums over up to this many beams need.
  void reserve(std::size_t beams);

  /// Loops may write up to this many passes past the last.
  static constexpr std::size_t kPassPadding = 16;
  /// Working memory of the loops that add: the passes of beams, at most one for each beam, and their count.
  std::vector<BeamPass> passes;
  std::size_t pass_count = 0;

 private:
  struct Array {
    std::vector<float> memory;
    float* values = nullptr;  ///< in the memory, aligned
    bool is_open = false;

    void takeMemory();
  };

  std::uint64_t blocks_ = 0;
  std::array<Array, 3> arrays_;  ///< by the axis of rows
};

}  // namespace bki_mapping
