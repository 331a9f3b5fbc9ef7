/// @file Types and constants that all rooms share.
#pragma once

#include <Eigen/Core>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace bki_mapping {

/// Id of a class in the run-time class table, 0 to 253.
using ClassId = std::uint8_t;
constexpr std::size_t kMaxClasses = 254;
/// Stands for `free` wherever a class id is stored; never an id of a class table.
constexpr ClassId kFreeClass = 255;
/// A set of classes; may contain kFreeClass.
using ClassSet = std::bitset<256>;

/// Edge of a block [voxels] and the number of voxels in it.
constexpr int kBlockEdge = 8;
constexpr int kBlockVoxels = kBlockEdge * kBlockEdge * kBlockEdge;

/// Half the diagonal of a voxel, sqrt(3) / 2, rounded up by more than single precision errs [voxels]. No
/// point is farther from the centre of its voxel.
constexpr float kVoxelHalfDiagonal = 0.8661f;

/// Marks a missing position in an array.
constexpr std::uint32_t kNoPosition = 0xffffffffu;

/// Integer coordinates of a voxel or block in the map frame's grid.
struct GridIndex {
  std::int32_t x = 0, y = 0, z = 0;
  bool operator==(const GridIndex& o) const { return x == o.x && y == o.y && z == o.z; }
  bool operator!=(const GridIndex& o) const { return !(*this == o); }
  /// Compares z, then y, then x: the order in which files list blocks.
  bool operator<(const GridIndex& o) const { return z != o.z ? z < o.z : (y != o.y ? y < o.y : x < o.x); }
};
struct VoxelIndex : GridIndex {};
struct BlockIndex : GridIndex {};

/// Multiplicative hash of the three coordinates. Tables use the low bits, so the high bits, which products
/// mix best, are folded into them.
struct GridIndexHash {
  std::size_t operator()(const GridIndex& i) const {
    const std::uint64_t h = static_cast<std::uint32_t>(i.x) * 0x9E3779B97F4A7C15ull +
                            static_cast<std::uint32_t>(i.y) * 0xC2B2AE3D27D4EB4Full +
                            static_cast<std::uint32_t>(i.z) * 0x165667B19E3779F9ull;
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

/// A view of contiguous values that it does not own, such as those of a std::vector or a NumPy array; like
/// std::span of C++20. Span<const T> reads only.
template <typename T>
class Span {
 public:
  Span() = default;
  Span(T* data, std::size_t size) : data_(data), size_(size) {}
  template <typename Vector, typename = decltype(static_cast<T*>(std::declval<Vector&>().data()))>
  Span(Vector&& vector) : data_(vector.data()), size_(vector.size()) {}  // NOLINT: as std::span

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T& operator[](std::size_t n) const { return data_[n]; }
  T* begin() const { return data_; }
  T* end() const { return data_ + size_; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace bki_mapping
