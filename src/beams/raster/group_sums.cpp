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

/// Adds four rows of four values to four other rows, transposed.
inline void addTransposed(const float* from, int from_row, float* to, int to_row) {
  Float4 rows[4];
  for (int n = 0; n < 4; ++n) rows[n] = LoadFour(from + n * from_row);
  Transpose4(rows);
  for (int n = 0; n < 4; ++n) AddU(rows[n], to + n * to_row);
}

/// Adds rows along x to a block's sums.
void addRows(const float* values, float* sums) {
  forEachRow(0, [&](int row, int offset) {
    for (int n = 0; n < kBlockEdge; ++n) sums[offset + n] += values[row + n];
  });
}

/// Adds rows along y or z.
void addTransposedRows(int row_axis, const float* values, float* sums) {
  constexpr int kOffset[3] = {1, kBlockEdge, kBlockEdge * kBlockEdge};
  const int other = 3 - row_axis, from_row = GroupSums::stride(row_axis, 0), to_row = kOffset[row_axis];
  for (int n = 0; n < kBlockEdge; ++n) {
    const float* const from = values + n * GroupSums::stride(row_axis, other);
    float* const to = sums + n * kOffset[other];
    for (int x = 0; x < kBlockEdge; x += 4) {
      for (int k = 0; k < kBlockEdge; k += 4) {
        addTransposed(from + x * from_row + k, from_row, to + x + k * to_row, to_row);
      }
    }
  }
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

void GroupSums::sumsOf(const std::array<int, 3>& position, float* sums) const {
  std::fill_n(sums, kBlockVoxels, 0.0f);
  const auto values = [&](int row_axis) {
    return arrays_[static_cast<std::size_t>(row_axis)].values + cornerOf(row_axis, position);
  };
  if (arrays_[0].is_open) addRows(values(0), sums);
  for (const int row_axis : {1, 2}) {
    if (arrays_[static_cast<std::size_t>(row_axis)].is_open)
      addTransposedRows(row_axis, values(row_axis), sums);
  }
}

void GroupSums::reserve(std::size_t beams) {
  if (passes.size() < beams + kPassPadding) passes.resize(beams + kPassPadding);
  for (Array& array : arrays_) array.takeMemory();
}

}  // namespace bki_mapping
