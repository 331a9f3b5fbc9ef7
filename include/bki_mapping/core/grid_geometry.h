/// @file The only conversions between points [m, map frame], voxels and blocks.
#pragma once

#include <cmath>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// The largest integer not above x. Unlike std::floor, it needs no instruction set beyond the baseline.
/// @param x within the range of an int32.
[[gnu::always_inline]] inline std::int32_t floorToInt(double x) {
  const auto towards_zero = static_cast<std::int32_t>(x);
  return towards_zero - static_cast<std::int32_t>(x < towards_zero);
}

/// Distance from a cell's face [cells] below which the rounding of a quotient can change the cell.
constexpr double kFaceMargin = 1e-6;

/// A grid of cubic voxels of edge `resolution` [m]; voxel (0,0,0) spans [0, resolution) on each axis.
/// Blocks hold 8 x 8 x 8 voxels.
class GridGeometry {
 public:
  /// Largest magnitude of a voxel's coordinates; points farther from the map's origin are refused.
  static constexpr double kMaxCoordinate = 1 << 28;

  /// @param resolution edge of a voxel [m], > 0.
  explicit GridGeometry(double resolution) : resolution_(resolution), per_metre_(1.0 / resolution) {}

  double resolution() const { return resolution_; }
  double blockSize() const { return resolution_ * kBlockEdge; }  ///< edge of a block [m]

  /// Whether the point is finite and its voxel has a valid index.
  bool contains(const Eigen::Vector3d& point) const {
    return (point.array().abs() < kMaxCoordinate * resolution_).all();  // false for NaN
  }
  /// A radius about `origin` within which every point has a valid index [m]; 0 or less if there is none.
  float safeRange(const Eigen::Vector3d& origin) const {
    return static_cast<float>(kMaxCoordinate * resolution_ * (1.0 - 1e-6) - origin.cwiseAbs().maxCoeff());
  }
  VoxelIndex voxelAt(const Eigen::Vector3d& point) const {
    return {{cell(point.x()), cell(point.y()), cell(point.z())}};
  }
  Eigen::Vector3d voxelCentre(const VoxelIndex& v) const {
    return Eigen::Vector3d(v.x + 0.5, v.y + 0.5, v.z + 0.5) * resolution_;
  }
  /// The corner of the block with the smallest coordinates [m].
  Eigen::Vector3d blockOrigin(const BlockIndex& b) const {
    return Eigen::Vector3d(b.x, b.y, b.z) * blockSize();
  }
  Eigen::Vector3d blockCentre(const BlockIndex& b) const {
    return Eigen::Vector3d(b.x + 0.5, b.y + 0.5, b.z + 0.5) * blockSize();
  }

  static BlockIndex blockOf(const VoxelIndex& v) {
    return {{floorDivide(v.x), floorDivide(v.y), floorDivide(v.z)}};
  }
  /// Offset of a voxel in the planes of its block: x + 8 y + 64 z, with x, y and z counted within the block.
  static int offsetInBlock(const VoxelIndex& v) {
    const int m = kBlockEdge - 1;
    return (v.x & m) + kBlockEdge * ((v.y & m) + kBlockEdge * (v.z & m));
  }
  static VoxelIndex voxelOf(const BlockIndex& b, int offset) {
    return {{b.x * kBlockEdge + offset % kBlockEdge, b.y * kBlockEdge + offset / kBlockEdge % kBlockEdge,
             b.z * kBlockEdge + offset / (kBlockEdge * kBlockEdge)}};
  }

 private:
  std::int32_t cell(double metres) const {
    // A product is faster than the exact quotient, which decides only next to a cell's face.
    const double quotient = metres * per_metre_;
    const std::int32_t floor = floorToInt(quotient);
    const double above = quotient - floor;
    return above > kFaceMargin && above < 1.0 - kFaceMargin ? floor : floorToInt(metres / resolution_);
  }
  static std::int32_t floorDivide(std::int32_t i) {
    static_assert(kBlockEdge == 8 && -1 >> 1 == -1, "a shift divides by the edge, towards minus infinity");
    return i >> 3;
  }

  double resolution_, per_metre_;
};

}  // namespace bki_mapping
