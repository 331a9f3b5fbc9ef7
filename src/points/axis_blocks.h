/// @file Which blocks a point reaches, axis by axis.
#pragma once

#include <array>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// A block that a point may reach, on one axis.
struct AxisBlock {
  int block;
  double local;      ///< the point from the block's first voxel centre [voxels]
  double distance2;  ///< to the block's nearest voxel centre on this axis, squared
};

/// Distance from a coordinate to the nearest voxel centre of a block, both from its first centre [voxels].
inline double distanceToCentres(double local) {
  const double last = kBlockEdge - 1;
  if (local < 0.0) return -local;
  if (local > last) return local - last;
  const double above = local - floorToInt(local);
  return above < 0.5 ? above : 1.0 - above;
}

/// The blocks of one axis with a voxel centre within reach of a point.
class AxisBlocks {
 public:
  /// @param home the block that holds the point. @param local the point from its first voxel centre [voxels].
  AxisBlocks(int home, double local, double reach) {
    const double at_home = distanceToCentres(local);
    if (at_home < reach) append(home, local, at_home);
    // The nearest centres of the blocks before and behind it are at -1, -9, ..., and at 8, 16, ...
    double away = local + 1.0;
    for (int n = 1; away < reach; ++n, away += kBlockEdge) append(home - n, local + n * kBlockEdge, away);
    away = kBlockEdge - local;
    for (int n = 1; away < reach; ++n, away += kBlockEdge) append(home + n, local - n * kBlockEdge, away);
  }
  const AxisBlock* begin() const { return blocks_.data(); }
  const AxisBlock* end() const { return blocks_.data() + count_; }

  static constexpr std::size_t kMost = 20;

 private:
  void append(int block, double local, double distance) {
    if (count_ < kMost) blocks_[count_++] = {block, local, distance * distance};
  }

  std::array<AxisBlock, kMost> blocks_;  // not initialised
  std::size_t count_ = 0;
};

}  // namespace bki_mapping
