/// @file Sums over beams at the voxels of a group of blocks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bki_mapping/inference/beam_box.h"

namespace bki_mapping {

/// Sums of the sparse kernel over beams, for each main axis of beams on its own: slice by slice, row by row,
/// with room around the group's voxels for what is added beside them.
class GroupSums {
 public:
  static constexpr int kPad = 8;   ///< voxels before and behind a row, and rows before and behind
  static constexpr int kRow = 64;  ///< from row to row
  static constexpr int kSlice = (kGroupVoxels + 2 * kPad) * kRow + 16;  ///< an odd number of cache lines
  static constexpr int kSlices = kGroupVoxels + 4;                      ///< some behind the group's
  static constexpr int kFirst = kPad * kRow + kPad;                     ///< the group's first voxel
  static_assert(kPad + kGroupVoxels + kPad <= kRow);

  GroupSums() = default;
  GroupSums(const GroupSums&) = delete;  // it points into its own memory, which a move takes along
  GroupSums& operator=(const GroupSums&) = delete;
  GroupSums(GroupSums&&) = default;
  GroupSums& operator=(GroupSums&&) = default;

  /// Forgets all sums. @param blocks that matter; of the others no sums are kept.
  void start(std::uint64_t blocks);
  /// Makes room for the sums of one main axis, which are 0 then. @return voxel (-kPad, -kPad) of the first
  /// slice.
  float* open(int axis);
  /// Sets `sums` to those of a block that matters. @param place in the group [blocks].
  void sumsOf(const std::array<int, 3>& place, float* sums) const;
  /// Provides for as much as `other` does.
  void reserveAs(const GroupSums& other);

  /// Working memory of what adds: passes, and how many of them there are.
  std::vector<BeamPass> passes;
  std::size_t pass_count = 0;

 private:
  struct Axis {
    std::vector<float> memory;
    float* numbers = nullptr;  ///< in the memory, aligned
    bool is_open = false;

    void takeMemory();
  };

  std::uint64_t blocks_ = 0;
  std::array<Axis, 3> axes_;
};

}  // namespace bki_mapping
