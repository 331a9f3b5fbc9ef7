/// @file The loops over points, compiled for each instruction set.
#pragma once

#include <cstddef>
#include <string>

#include "bki_mapping/map/block.h"
#include "points/local_point.h"
#include "points/tile_grid.h"

namespace bki_mapping {

/// The loops for one instruction set.
struct PointKernels {
  const char* instruction_set;
  /// Sets the sums of the 512 voxels of a block to those of the sparse kernel k(|x - c|) over points that
  /// reach the block.
  /// @param reach length of the kernel [voxels]. @param scale of the kernel. @return layers that hold all
  /// sums above 0.
  Block::Layers (*sum_points)(const PointRun* runs, std::size_t count, float reach, float scale, float* sums);
  /// Finds the cells and tiles in which the first `count` points of a batch lie: the cell of
  /// GridGeometry::voxelAt, to the bit.
  void (*locate_points)(const TileGrid& grid, const PointSpan& points, std::size_t count,
                        TilePositions& positions);
  /// The same, of cells and tiles only; `inside` is left as it is.
  void (*locate_cells)(const TileGrid& grid, const PointSpan& points, std::size_t count,
                       TilePositions& positions);
  /// Finds the blocks that points reach whose tiles, found before, are blocks. @param reach [voxels], at
  /// most 8.
  void (*reach_blocks)(std::size_t count, float reach, TilePositions& positions);
};

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const PointKernels& pointKernelsFor(const std::string& instruction_set);

}  // namespace bki_mapping
