/// @file Points sorted by the blocks that they reach.
#pragma once

#include <array>
#include <vector>

#include "kernel/sparse_kernel.h"
#include "parallel/index_numbering.h"
#include "parallel/ordered_queue.h"
#include "parallel/runs_by_index.h"
#include "parallel/thread_pool.h"
#include "points/downsample.h"
#include "points/local_point.h"
#include "points/point_kernels.h"

namespace bki_mapping {

/// Points, each in every block that has a voxel centre within its kernel's reach; with the counting kernel in
/// the block that holds it. Keeps its memory from scan to scan.
class PointBins {
 public:
  /// @throws std::invalid_argument if a sparse kernel is longer than 72 voxels.
  PointBins(const GridGeometry& geometry, const VoxelKernel& kernel, const PointKernels& kernels);

  /// Replaces the points. @param points merged, relative to the origin. @param origin in the map frame [m].
  /// @param home_always whether a point is sorted into the block that holds it even if it reaches none of its
  /// centres. @throws TooMuchWork if they reach too many blocks to be kept in each.
  void setPoints(const Eigen::Vector3d& origin, const Downsampler& points, bool home_always,
                 ThreadPool& pool);

  /// Exactly the blocks that points reach, or, with `home_always`, are in.
  const IndexNumbering& blocks() const { return blocks_.indices(); }

  /// The points of a block by its number in blocks(), run by run, in an order that does not depend on the
  /// number of workers.
  const PointRun* begin(std::size_t block) const { return blocks_.begin(block); }
  const PointRun* end(std::size_t block) const { return blocks_.end(block); }
  /// Whether all points are of one class.
  bool oneClass() const { return one_class_; }

 private:
  /// Working memory of one thread.
  struct alignas(kThreadsApart) Scratch {
    TilePlaces places;
    const ClassId* labels = nullptr;     ///< of the batch
    std::array<std::uint32_t, 27> near;  ///< numbers of the blocks around `home`, or none
    GridIndex home;
    std::vector<LocalPoint> points;    ///< of the group, as they come
    std::vector<std::uint32_t> block;  ///< number of the block of each
    std::size_t size = 0;              ///< of these two; they are longer
  };
  /// The points of a group of the down-sampler's, by block.
  struct alignas(kThreadsApart) Group {
    IndexNumbering blocks;
    std::vector<std::uint32_t> begin;  ///< of each block's points; one more than blocks
    std::vector<LocalPoint> points;
    std::vector<std::uint64_t> classes;  ///< of each block's points, as PointRun has them
    ClassId first_class;                 ///< of the first point
    bool has_other_class;
  };

  void start(std::size_t groups, const ThreadPool& pool);
  void binGroup(const TileGrid& grid, const MergedPoints& points, Scratch& scratch, Group& group) const;
  void binBatch(std::size_t count, Scratch& scratch, Group& group) const;
  void binNear(std::size_t count, Scratch& scratch, Group& group) const;
  void binFar(std::size_t i, Scratch& scratch, Group& group) const;
  void sortGroup(const Scratch& scratch, Group& group) const;
  void collectRuns(const Group& group);

  GridGeometry geometry_;
  VoxelKernel kernel_;
  const PointKernels& kernels_;
  bool home_always_ = false, one_class_ = false;
  std::vector<Scratch> scratch_;  ///< one a worker
  std::vector<Group> groups_;
  OrderedQueue turns_;  ///< of groups, to hand their runs to
  RunsByIndex<PointRun> blocks_;
};

}  // namespace bki_mapping
