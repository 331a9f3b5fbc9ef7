/// @file The innermost loops of point and line evidence, compiled for several instruction sets.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "beams/beam_cells.h"
#include "beams/raster/group_sums.h"
#include "bki_mapping/beams/beam_config.h"
#include "bki_mapping/map/block.h"
#include "points/local_point.h"
#include "points/tile_grid.h"

namespace bki_mapping {

/// The loops for one instruction set. All sums are of the sparse kernel.
struct InnerLoops {
  const char* instruction_set;
  /// Sets the sums of the 512 voxels of a block to those of k(|x - c|) over points that reach the block.
  /// @param reach length of the kernel [voxels]. @param scale of the kernel. @return the layers outside of
  /// which all sums are 0.
  Block::Layers (*sum_points)(const PointRun* runs, std::size_t count, float reach, float scale, float* sums);
  /// Makes tracks of beams. @param beams from the sensor to their ends [m]. @param resolution [m]. @param
  /// reach length of the kernel [voxels], at most kMostTrackReach.
  void (*make_tracks)(const Eigen::Vector3f* beams, std::size_t count, double resolution, float reach,
                      const BeamTrackTargets& to);
  /// Sets the sums of the blocks of a box that matter to those of w(rho) k(d) over the beams of some ranges,
  /// the kernel being of unit scale: d the distance to the beam's line, w the weight along it, 0 unless 0 <
  /// rho < 1.
  /// @param beams made by make_tracks of the same instruction set.
  void (*trace_beams)(const BeamTrackArrays& beams, const BeamRange* ranges, std::size_t count,
                      const BeamBox& box, BeamWeight weight, GroupSums& sums);
  /// Finds the cells and tiles in which the first `count` points of a batch lie: the cell of
  /// GridGeometry::voxelAt, to the bit.
  void (*place_points)(const TileGrid& grid, const PointSpan& points, std::size_t count, TilePlaces& places);
  /// The same, of cells and tiles alone; where a point is inside a tile is left open.
  void (*place_cells)(const TileGrid& grid, const PointSpan& points, std::size_t count, TilePlaces& places);
  /// Finds the blocks that placed points reach, tiles being blocks. @param reach [voxels], at most 8.
  void (*reach_blocks)(std::size_t count, float reach, TilePlaces& places);
  float kernel_unit;  ///< in which tracks measure distances, by lengths of the kernel
};

/// The instruction sets that this build and this processor have: "generic" first, better ones behind it.
std::vector<std::string> instructionSets();

/// The loops for one of instructionSets(); for the best of them if the name is empty.
/// @throws std::invalid_argument for any other name.
const InnerLoops& innerLoopsFor(const std::string& instruction_set);

}  // namespace bki_mapping
