/// @file The loops over points, compiled for each instruction set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "bki_mapping/map/block.h"
#include "points/tile_grid.h"

namespace bki_mapping {

/// A labelled point: [voxels], from the centre of the block's first voxel.
struct LocalPoint {
  static constexpr std::uint16_t kOutside = 0xffff;

  float x, y, z;
  std::uint16_t label;
  std::uint16_t voxel;  ///< that holds it, or kOutside if that is in another block
};

/// Some of the points of a block.
struct PointRun {
  const LocalPoint* points;
  std::size_t count;
  std::uint64_t classes = 0;  ///< of the points, by classBit(); not set where all points of a scan are of one
  const float* weights = nullptr;  ///< of the points; null if all are 1

  /// The bit of a class; large ids share the last one.
  static constexpr std::uint32_t kSharedBit = 63;
  static std::uint64_t classBit(std::uint32_t label) {
    return std::uint64_t{1} << (label < kSharedBit ? label : kSharedBit);
  }
};

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
