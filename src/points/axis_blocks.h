/// @file The blocks that a kernel about a point may reach on one axis, for kernels of any length.
#pragma once

#include <array>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// A block that a point may reach, on one axis.
struct AxisBlock {
  int block;         ///< index
  double local;      ///< the point, relative to the block's first voxel centre [voxels]
  double distance2;  ///< squared distance to the block's nearest voxel centre on this axis [voxels^2]
};

/// Distance to a block's nearest voxel centre [voxels]. @param local relative to its first voxel centre.
inline double distanceToCentres(double local) {
  const double last = kBlockEdge - 1;
  if (local < 0.0) return -local;
  if (local > last) return local - last;
  const double above = local - floorToInt(local);
  return above < 0.5 ? above : 1.0 - above;
}

/// The blocks that have a voxel centre within reach of a point on one axis.
class AxisBlocks {
 public:
  /// @param block that contains the point. @param local the point, relative to its first voxel centre
  /// [voxels]. @param reach of the kernel [voxels].
  AxisBlocks(int block, double local, double reach) {
    const double inside = distanceToCentres(local);
    if (inside < reach) append(block, local, inside);
    // The nearest centres of preceding blocks are at -1, -9, ..., those of following blocks at 8, 16, ...
    double distance = local + 1.0;
    for (int n = 1; distance < reach; ++n, distance += kBlockEdge) {
      append(block - n, local + n * kBlockEdge, distance);
    }
    distance = kBlockEdge - local;
    for (int n = 1; distance < reach; ++n, distance += kBlockEdge) {
      append(block + n, local - n * kBlockEdge, distance);
    }
  }
  const AxisBlock* begin() const { return blocks_.data(); }
  const AxisBlock* end() const { return blocks_.data() + count_; }

  static constexpr std::size_t kMost = 20;  ///< blocks; enough for VoxelKernel::kMaxReach

 private:
  void append(int block, double local, double distance) {
    if (count_ < kMost) blocks_[count_++] = {block, local, distance * distance};
  }

  std::array<AxisBlock, kMost> blocks_;  // uninitialised, to save time
  std::size_t count_ = 0;
};

}  // namespace bki_mapping
