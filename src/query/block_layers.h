/// @file Sets of voxels of a block, of which 64 are handled at once.
#pragma once

#include <array>
#include <cstdint>

#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// A set of voxels of a block: those of each layer along z, with bit x + 8 y, as in BlockStates::Layer.
using BlockLayers = std::array<std::uint64_t, kBlockEdge>;

constexpr int kLastInBlock = kBlockEdge - 1;
constexpr std::uint64_t kAllOfLayer = ~std::uint64_t{0};
constexpr std::uint64_t kFirstColumn = kAllOfLayer / 0xff;           ///< the voxels with x = 0 of a layer
constexpr std::uint64_t kLastColumn = kFirstColumn << kLastInBlock;  ///< those with x = 7
constexpr std::uint64_t kFirstRow = 0xff;                            ///< those with y = 0
constexpr std::uint64_t kLastRow = kFirstRow << kBlockEdge * kLastInBlock;  ///< those with y = 7

inline std::uint64_t anyLayer(const BlockLayers& layers) {
  std::uint64_t any = 0;
  for (const std::uint64_t layer : layers) any |= layer;
  return any;
}

// Voxels of a layer and those beside them along an axis: what of these lies in the same block (step 0), or in
// the next one in either direction (step 1 or -1).
inline std::uint64_t besideX(std::uint64_t layer, int step) {
  if (step > 0) return layer >> kLastInBlock & kFirstColumn;
  if (step < 0) return layer << kLastInBlock & kLastColumn;
  return layer | (layer << 1 & ~kFirstColumn) | (layer >> 1 & ~kLastColumn);
}
inline std::uint64_t besideY(std::uint64_t layer, int step) {
  constexpr int kToLastRow = kBlockEdge * kLastInBlock;
  if (step > 0) return layer >> kToLastRow;
  if (step < 0) return layer << kToLastRow;
  return layer | layer << kBlockEdge | layer >> kBlockEdge;
}
/// The voxels of a layer and those that share a face or an edge with them.
inline std::uint64_t besideInLayer(std::uint64_t layer) {
  return besideY(besideX(layer, 0), 0);
}

/// What of `within` is connected with `seed`, of which it contains one voxel, inside the layer.
inline std::uint64_t growInLayer(std::uint64_t within, std::uint64_t seed) {
  for (;;) {
    const std::uint64_t grown = besideInLayer(seed) & within;
    if (grown == seed) return seed;
    seed = grown;
  }
}

/// What of `within` is connected with `seed` inside the block, by faces, edges or corners.
inline BlockLayers growInBlock(const BlockLayers& within, BlockLayers seed) {
  const auto growFrom = [&](std::size_t z, std::uint64_t beside) {
    const std::uint64_t reached = (seed[z] | besideInLayer(beside)) & within[z];
    if (reached == seed[z]) return false;
    seed[z] = growInLayer(within[z], reached);
    return true;
  };
  for (std::size_t z = 0; z < kBlockEdge; ++z) {
    if (seed[z] != 0) seed[z] = growInLayer(within[z], seed[z]);
  }
  for (bool grows = true; grows;) {  // up, then down
    grows = false;
    for (std::size_t z = 1; z < kBlockEdge; ++z) grows |= growFrom(z, seed[z - 1]);
    for (std::size_t z = kBlockEdge - 1; z-- > 0;) grows |= growFrom(z, seed[z + 1]);
  }
  return seed;
}

/// Calls visit(dx, dy, dz, voxels) for the neighbours of voxels in 13 of the 26 blocks around theirs, so that
/// of two blocks one is visited from the other. Blocks in which there are none may be left out.
template <typename Visit>
void forEachNextBlock(const BlockLayers& voxels, Visit&& visit) {
  const std::uint64_t any = anyLayer(voxels), top = voxels[kBlockEdge - 1];
  if (top != 0) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const std::uint64_t beside = besideY(besideX(top, dx), dy);
        if (beside != 0) visit(dx, dy, 1, BlockLayers{beside});
      }
    }
  }
  const auto visitBeside = [&](int dx, int dy) {
    BlockLayers in_layer, beside;
    for (std::size_t z = 0; z < kBlockEdge; ++z) in_layer[z] = besideY(besideX(voxels[z], dx), dy);
    for (std::size_t z = 0; z < kBlockEdge; ++z) {
      beside[z] = in_layer[z] | (z > 0 ? in_layer[z - 1] : 0) | (z + 1 < kBlockEdge ? in_layer[z + 1] : 0);
    }
    visit(dx, dy, 0, beside);
  };
  if (any & kLastColumn) visitBeside(1, 0);
  if ((any & kLastRow) == 0) return;
  visitBeside(0, 1);
  if (any & kLastRow & kFirstColumn) visitBeside(-1, 1);
  if (any & kLastRow & kLastColumn) visitBeside(1, 1);
}

inline bool overlap(const BlockLayers& a, const BlockLayers& b) {
  std::uint64_t any = 0;
  for (std::size_t z = 0; z < kBlockEdge; ++z) any |= a[z] & b[z];
  return any != 0;
}

}  // namespace bki_mapping
