#include "beams/raster/group_sums.h"

#include <algorithm>
#include <memory>

#include "simd/vec_generic.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kCacheLine = 16;  ///< [floats]

/// Where a block's first voxel is in the array of a row axis. @param position in the group [blocks].
int cornerOf(int row_axis, const std::array<int, 3>& position) {
  int corner = GroupSums::kFirst;
  for (int axis = 0; axis < 3; ++axis) {
    corner += kBlockEdge * position[static_cast<std::size_t>(axis)] * GroupSums::stride(row_axis, axis);
  }
  return corner;
}

/// Calls visit(row, offset) for the rows of a block: where the first voxel of a row is, from the block's
/// first on, and in the block's sums.
template <typename Visit>
void forEachRow(int row_axis, Visit&& visit) {
  constexpr int kOffset[3] = {1, kBlockEdge, kBlockEdge * kBlockEdge};
  const int a = row_axis == 0 ? 1 : 0, b = row_axis == 2 ? 1 : 2;  // the other axes
  for (int n = 0; n < kBlockEdge; ++n) {
    for (int m = 0; m < kBlockEdge; ++m) {
      visit(n * GroupSums::stride(row_axis, b) + m * GroupSums::stride(row_axis, a),
            n * kOffset[b] + m * kOffset[a]);
    }
  }
}

/// Adds rows along x to a block's sums.
void addRows(const float* values, float* sums) {
  forEachRow(0, [&](int row, int offset) {
    for (int n = 0; n < kBlockEdge; ++n) sums[offset + n] += values[row + n];
  });
}

/// Calls visit(four, offset) for all of a block's sums, transposed from rows along y or z to rows along x:
/// four of them, and where they are in the block.
template <typename Visit>
void forEachTransposed(int row_axis, const float* values, Visit&& visit) {
  constexpr int kOffset[3] = {1, kBlockEdge, kBlockEdge * kBlockEdge};
  const int other = 3 - row_axis, from_row = GroupSums::stride(row_axis, 0), to_row = kOffset[row_axis];
  for (int n = 0; n < kBlockEdge; ++n) {
    const float* const from = values + n * GroupSums::stride(row_axis, other);
    for (int x = 0; x < kBlockEdge; x += 4) {
      for (int k = 0; k < kBlockEdge; k += 4) {
        Float4 rows[4];
        for (int m = 0; m < 4; ++m) rows[m] = LoadFour(from + (x + m) * from_row + k);
        Transpose4(rows);
        for (int m = 0; m < 4; ++m) visit(rows[m], n * kOffset[other] + x + (k + m) * to_row);
      }
    }
  }
}

/// Scales sums; rounding can make the tail of the kernel slightly negative, which becomes 0.
/// @param[in,out] some other than 0 if any sum is above 0.
inline Float4 scaled(Float4 sums, float scale, Mask& some) {
  const Float4 product = sums * scale;
  const Mask is_some = product > 0.0f;
  some |= is_some;
  return is_some ? product : Float4{};
}

}  // namespace

void GroupSums::Array::takeMemory() {
  if (values) return;
  memory.resize(kArray + kCacheLine);
  void* at = memory.data();
  std::size_t space = memory.size() * sizeof(float);
  values = static_cast<float*>(std::align(kCacheLine * sizeof(float), kArray * sizeof(float), at, space));
}

void GroupSums::start(std::uint64_t blocks) {
  blocks_ = blocks;
  for (Array& array : arrays_) array.is_open = false;
}

float* GroupSums::open(int row_axis) {
  Array& array = arrays_[static_cast<std::size_t>(row_axis)];
  array.is_open = true;
  for (int n = 0; n < kGroupEdge * kGroupEdge * kGroupEdge; ++n) {
    if ((blocks_ >> n & 1) == 0) continue;
    float* const block = array.values + cornerOf(row_axis, {n % kGroupEdge, n / kGroupEdge % kGroupEdge,
                                                            n / (kGroupEdge * kGroupEdge)});
    forEachRow(row_axis, [&](int row, int) { std::fill_n(block + row, kBlockEdge, 0.0f); });
  }
  return array.values + kFirst;
}

bool GroupSums::sumsOf(const std::array<int, 3>& position, float scale, float* sums) const {
  const auto isOpen = [&](int row_axis) { return arrays_[static_cast<std::size_t>(row_axis)].is_open; };
  const auto values = [&](int row_axis) {
    return arrays_[static_cast<std::size_t>(row_axis)].values + cornerOf(row_axis, position);
  };
  static_assert(kLanes == 4, "a FloatVec of vec_generic.h is a Float4");
  Mask some = {};
  if (!isOpen(0) && isOpen(1) != isOpen(2)) {  // as nearly always
    const int row_axis = isOpen(1) ? 1 : 2;
    forEachTransposed(row_axis, values(row_axis),
                      [&](Float4 four, int offset) { StoreU(scaled(four, scale, some), sums + offset); });
    return AnyTrue(some);
  }
  std::fill_n(sums, kBlockVoxels, 0.0f);
  if (isOpen(0)) addRows(values(0), sums);
  for (const int row_axis : {1, 2}) {
    if (!isOpen(row_axis)) continue;
    forEachTransposed(row_axis, values(row_axis),
                      [&](Float4 four, int offset) { AddU(four, sums + offset); });
  }
  for (int v = 0; v < kBlockVoxels; v += kLanes) {
    StoreU(scaled(LoadFour(sums + v), scale, some), sums + v);
  }
  return AnyTrue(some);
}

void GroupSums::reserve(std::size_t beams) {
  if (passes.size() < beams + kPassPadding) passes.resize(beams + kPassPadding);
  for (Array& array : arrays_) array.takeMemory();
}

}  // namespace bki_mapping
