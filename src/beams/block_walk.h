/// @file Which blocks lie along beams, or around the sensor.
#pragma once

#include <atomic>
#include <memory>

#include "beams/beams.h"
#include "bki_mapping/map/semantic_map.h"
#include "parallel/index_numbering.h"
#include "parallel/thread_pool.h"
#include "update/work_limit.h"

namespace bki_mapping {

/// The piece of each beam that is walked: from the sensor to its end or, for the shadow of its hit, from
/// there to `shadow_range` [m from the sensor].
struct BeamPiece {
  bool shadow = false;
  double shadow_range = 0.0;
};

/// Names the blocks along beams. Keeps its memory from scan to scan.
class BlockWalk {
 public:
  /// Inserts every block with a voxel centre within `reach` [m] of a beam's piece, and some around those.
  /// @param most of them, those not counted that are in `blocks` before. @throws TooMuchWork if there are
  /// more.
  void insertBlocksAlong(const GridGeometry& geometry, const Beams& beams, const BeamPiece& piece,
                         double reach, std::size_t most, ThreadPool& pool, IndexNumbering& blocks);

 private:
  /// A box of blocks, each marked or not: a hash table would be slower for the many blocks that beams share.
  struct Box {
    Eigen::Array3i low, size;
    std::size_t place(int x, int y, int z) const {
      return static_cast<std::size_t>(x - low.x()) +
             static_cast<std::size_t>(size.x()) *
                 (static_cast<std::size_t>(y - low.y()) +
                  static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(z - low.z()));
    }
  };

  void clearMarks(std::size_t count);
  void insertMarked(const Box& box, IndexNumbering& blocks) const;

  std::unique_ptr<std::atomic<std::uint8_t>[]> marks_;
  std::size_t capacity_ = 0;
};

/// Inserts the blocks of the map that come within `range` [m] of a point of the map frame.
void insertMappedBlocks(const SemanticMap& map, const Eigen::Vector3d& point, double range,
                        IndexNumbering& blocks);

}  // namespace bki_mapping
