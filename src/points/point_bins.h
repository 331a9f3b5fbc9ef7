/// @file Points sorted by the blocks that they reach.
#pragma once

#include <array>
#include <vector>

#include "kernel/sparse_kernel.h"
#include "parallel/group_by.h"
#include "parallel/index_numbering.h"
#include "parallel/ordered_queue.h"
#include "parallel/thread_pool.h"
#include "points/merged_points.h"
#include "points/point_kernels.h"
#include "update/evidence.h"

namespace bki_mapping {

/// Points sorted by block. A point is stored in every block that has a voxel centre within the kernel's
/// reach; with the counting kernel, and points of confined classes, in its containing block. Keeps its memory
/// from scan to scan.
class PointBins {
 public:
  PointBins(const GridGeometry& geometry, const VoxelKernel& kernel, const PointKernels& kernels,
            const ClassSet& confined = {});

  /// Replaces the points. @param points relative to the origin. @param origin in the map frame [m].
  /// @param keep_containing whether to store a point in its containing block even if it reaches no voxel
  /// centre there. @throws TooMuchWork if storing the points in every block that they reach would take too
  /// much memory.
  void setPoints(const Eigen::Vector3d& origin, const PointGroups& points, bool keep_containing,
                 ThreadPool& pool);

  /// Exactly the blocks that points reach and, with `keep_containing`, those that contain points; of points
  /// of confined classes, those that contain them.
  const IndexNumbering& blocks() const { return blocks_.indices(); }

  /// The points of a block, given its position in blocks(), as runs whose order does not depend on the number
  /// of workers.
  const PointRun* begin(std::size_t block) const { return blocks_.begin(block); }
  const PointRun* end(std::size_t block) const { return blocks_.end(block); }
  /// Whether all points have the same class.
  bool oneClass() const { return one_class_; }
  /// Whether points have weights.
  bool weighted() const { return weighted_; }

 private:
  /// Working memory of one thread.
  struct alignas(kThreadsApart) Scratch {
    TilePositions positions;
    const ClassId* labels = nullptr;  ///< of the batch
    const float* weights = nullptr;   ///< of the batch, if its points have weights
    GridIndex containing;             ///< containing block of the last point
    /// Position in Group::blocks of that block and its neighbours, or kNoPosition.
    std::array<std::uint32_t, 27> neighbours;
    std::vector<LocalPoint> points;    ///< of the group, unsorted
    std::vector<float> weight;         ///< of each point, if they have weights
    std::vector<std::uint32_t> block;  ///< of each point: position in Group::blocks
    std::size_t size = 0;              ///< elements in use of the last three arrays
  };
  /// The points of one of the PointGroups, by block.
  struct alignas(kThreadsApart) Group {
    IndexNumbering blocks;
    std::vector<std::uint32_t> begin;  ///< of each block's points; one element more than blocks
    std::vector<LocalPoint> points;
    std::vector<float> weights;          ///< of the points, if they have any
    std::vector<std::uint64_t> classes;  ///< of each block's points, as in PointRun::classes
    ClassId first_class;                 ///< of the first point
    bool has_other_class;
  };

  void start(std::size_t groups, const ThreadPool& pool);
  void binGroup(const TileGrid& grid, const MergedPoints& points, Scratch& scratch, Group& group) const;
  /// Makes room for this many points.
  void reserve(std::size_t points, Scratch& scratch) const;
  template <bool kWeighted>
  void binBatch(std::size_t count, Scratch& scratch, Group& group) const;
  template <bool kWeighted>
  void binToNeighbours(std::size_t count, Scratch& scratch, Group& group) const;
  template <bool kWeighted>
  void binToAll(std::size_t i, Scratch& scratch, Group& group) const;
  void sortGroup(const Scratch& scratch, Group& group) const;
  void collectRuns(const Group& group);

  GridGeometry geometry_;
  VoxelKernel kernel_;
  const PointKernels& kernels_;
  ClassSet confined_;
  bool keep_containing_ = false, one_class_ = false, weighted_ = false;
  std::vector<Scratch> scratch_;  ///< one for each worker
  std::vector<Group> groups_;
  OrderedQueue queue_;  ///< of finished groups, whose runs are collected in order
  RunsByIndex<PointRun> blocks_;
};

}  // namespace bki_mapping
