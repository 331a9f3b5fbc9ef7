/// @file Lists the blocks along beams, or around the sensor.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "beams/beams.h"
#include "bki_mapping/map/semantic_map.h"
#include "parallel/index_numbering.h"
#include "parallel/thread_pool.h"
#include "update/work_limit.h"

namespace bki_mapping {

/// The piece of each beam that is walked: from the sensor to the beam's end or, for the shadow of the hit,
/// from the end to `shadow_range` [m from the sensor].
struct BeamPiece {
  bool shadow = false;
  double shadow_range = 0.0;
};

/// Lists the blocks along beams. Keeps its memory from scan to scan.
class BlockWalk {
 public:
  /// Appends every block that has a voxel centre within `reach` [m] of a beam's piece, and some around those,
  /// each once. @param most blocks. @throws TooMuchWork if there are more.
  void listBlocksAlong(const GridGeometry& geometry, const Beams& beams, const BeamPiece& piece, double reach,
                       std::size_t most, ThreadPool& pool, std::vector<GridIndex>& blocks);

 private:
  /// A dense box of blocks to be marked. Beams cross the same blocks many times, so this is faster than a
  /// hash table.
  struct Box {
    Eigen::Array3i low, size;
  };

  /// Makes `count` cleared marks.
  void clearMarks(std::size_t count);
  /// Appends the marked blocks in the order of their offsets, whichever thread marked them.
  void listMarked(const Box& box, std::vector<GridIndex>& blocks) const;

  std::unique_ptr<std::uint8_t[]> marks_;  ///< x fastest
  std::size_t capacity_ = 0;
  IndexNumbering unmarked_;  ///< blocks along beams whose box is too large for marks
};

/// Appends the blocks of the map that come within `range` [m] of a point of the map frame.
void listMappedBlocks(const SemanticMap& map, const Eigen::Vector3d& point, double range,
                      std::vector<GridIndex>& blocks);

}  // namespace bki_mapping
