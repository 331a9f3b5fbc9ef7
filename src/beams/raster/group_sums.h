/// @file Sums over beams at the voxels of a group of blocks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "beams/raster/beam_box.h"

namespace bki_mapping {

/// Sums of the sparse kernel over beams, in rows of voxels along an axis; for each of the three axes there
/// are such rows on their own. There is room around the group's voxels for what is added beside them.
class GroupSums {
 public:
  static constexpr int kPad = 8;                                           ///< voxels before and behind a row
  static constexpr int kBeside = 6;                                        ///< rows on each side
  static constexpr int kRow = kGroupVoxels + 2 * kPad;                     ///< from row to row
  static constexpr int kPlane = (kGroupVoxels + 2 * kBeside) * kRow + 16;  ///< an odd number of cache lines
  static constexpr int kArray = (kGroupVoxels + 2 * kBeside) * kPlane;     ///< all rows along an axis
  static constexpr int kFirst = kBeside * kPlane + kBeside * kRow + kPad;  ///< the group's first voxel

  /// From voxel to voxel along an axis, where rows lie along another.
  static constexpr int stride(int row_axis, int axis) {
    return axis == row_axis ? 1 : axis == (row_axis == 0 ? 1 : 0) ? kRow : kPlane;
  }

  GroupSums() = default;
  GroupSums(const GroupSums&) = delete;  // it points into its own memory, which a move takes along
  GroupSums& operator=(const GroupSums&) = delete;
  GroupSums(GroupSums&&) = default;
  GroupSums& operator=(GroupSums&&) = default;

  /// Forgets all sums. @param blocks that matter; of the others no sums are kept.
  void start(std::uint64_t blocks);
  /// Makes room for sums in rows along an axis, which are 0 then. @return the group's first voxel there.
  float* open(int row_axis);
  /// Sets `sums` to those of a block that matters. @param place in the group [blocks].
  void sumsOf(const std::array<int, 3>& place, float* sums) const;
  /// Takes all memory that sums over so many beams can need.
  void reserve(std::size_t beams);

  /// Inner loops may write this many passes past the last.
  static constexpr std::size_t kPassPadding = 16;
  /// Working memory of what adds: passes, and how many of them there are. There is room for one a beam.
  std::vector<BeamPass> passes;
  std::size_t pass_count = 0;

 private:
  struct Array {
    std::vector<float> memory;
    float* numbers = nullptr;  ///< in the memory, aligned
    bool is_open = false;

    void takeMemory();
  };

  std::uint64_t blocks_ = 0;
  std::array<Array, 3> arrays_;  ///< by the axis of rows
};

}  // namespace bki_mapping
