#include "bki_mapping/inference/group_sums.h"

#include <algorithm>
#include <memory>

namespace bki_mapping {
namespace {

constexpr std::size_t kCacheLine = 16;  ///< [floats]

/// Calls visit(row, offset) for the rows of a block: where a row's first voxel is in the array of a main
/// axis, and in the block's sums. @param place of the block in its group.
template <typename Visit>
void forEachRow(int axis, const std::array<int, 3>& place, Visit&& visit) {
  constexpr int kStride[3] = {1, kBlockEdge, kBlockEdge * kBlockEdge};
  const auto first = [&](int of) { return kBlockEdge * place[static_cast<std::size_t>(of)]; };
  const int corner = GroupSums::kFirst + first(axis) * GroupSums::kSlice +
                     first(kRowAxis[axis]) * GroupSums::kRow + first(kLaneAxis[axis]);
  for (int slice = 0; slice < kBlockEdge; ++slice) {
    for (int row = 0; row < kBlockEdge; ++row) {
      visit(corner + slice * GroupSums::kSlice + row * GroupSums::kRow,
            slice * kStride[axis] + row * kStride[kRowAxis[axis]]);
    }
  }
}

template <int kLaneStride>
void addBlock(int axis, const std::array<int, 3>& place, const float* numbers, float* sums) {
  forEachRow(axis, place, [&](int row, int offset) {
    for (int n = 0; n < kBlockEdge; ++n) sums[offset + n * kLaneStride] += numbers[row + n];
  });
}

}  // namespace

void GroupSums::Axis::takeMemory() {
  if (numbers) return;
  constexpr std::size_t kSize = kSlices * kSlice;
  memory.resize(kSize + kCacheLine);
  void* at = memory.data();
  std::size_t space = memory.size() * sizeof(float);
  numbers = static_cast<float*>(std::align(kCacheLine * sizeof(float), kSize * sizeof(float), at, space));
}

void GroupSums::start(std::uint64_t blocks) {
  blocks_ = blocks;
  for (Axis& axis : axes_) axis.is_open = false;
}

float* GroupSums::open(int axis) {
  Axis& sums = axes_[static_cast<std::size_t>(axis)];
  sums.takeMemory();
  sums.is_open = true;
  for (int n = 0; n < kGroupEdge * kGroupEdge * kGroupEdge; ++n) {
    if ((blocks_ >> n & 1) == 0) continue;
    const std::array<int, 3> place = {n % kGroupEdge, n / kGroupEdge % kGroupEdge,
                                      n / (kGroupEdge * kGroupEdge)};
    forEachRow(axis, place, [&](int row, int) { std::fill_n(sums.numbers + row, kBlockEdge, 0.0f); });
  }
  return sums.numbers;
}

void GroupSums::sumsOf(const std::array<int, 3>& place, float* sums) const {
  std::fill_n(sums, kBlockVoxels, 0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    const Axis& from = axes_[static_cast<std::size_t>(axis)];
    if (!from.is_open) continue;
    if (kLaneAxis[axis] == 0) {
      addBlock<1>(axis, place, from.numbers, sums);
    } else {
      addBlock<kBlockEdge>(axis, place, from.numbers, sums);
    }
  }
}

void GroupSums::reserveAs(const GroupSums& other) {
  if (passes.size() < other.passes.size()) passes.resize(other.passes.size());
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    if (other.axes_[axis].numbers) axes_[axis].takeMemory();
  }
}

}  // namespace bki_mapping
