/// @file Evidence of points: hits or free samples.
#pragma once

#include <array>
#include <string>

#include "points/point_bins.h"
#include "update/evidence.h"

namespace bki_mapping {

/// Adds k(|x - c|), times the weight of the point, to the class of each point x at every voxel centre c
/// within the support radius. With the counting kernel, adds the weight to the voxel that contains the point,
/// and for confined classes VoxelKernel::total times the weight. Equations (3), (3a) and (4) of
/// docs/method.md. Keeps its memory from scan to scan.
class PointEvidence : public Evidence {
 public:
  /// @param reports_voxels whether to report the voxels that contain a point (BlockSums::occupied).
  /// @param confined classes whose points add evidence only to the voxels that contain them.
  /// @param instruction_set one of instructionSets(); "" selects the best that the processor has.
  /// @throws std::invalid_argument as VoxelKernel.
  PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel, bool reports_voxels = false,
                const ClassSet& confined = {}, const std::string& instruction_set = "");

  /// Replaces the points. @param points relative to the origin. @param origin in the map frame [m].
  /// @throws TooMuchWork as PointBins.
  void setPoints(const Eigen::Vector3d& origin, const PointGroups& points, ThreadPool& pool);
  std::size_t size() const { return size_; }  ///< number of points

  /// Exactly the blocks that have a voxel centre within reach of a point and, if voxels are reported, those
  /// that contain a point; of points of confined classes, only those that contain them.
  const std::vector<GridIndex>& touchedBlocks(const SemanticMap& map, std::size_t most,
                                              ThreadPool& pool) override;
  void markClasses(std::size_t position, ClassSet& classes) const override;
  void reserve(std::size_t workers) override;
  void accumulate(const BlockGroup& group, const std::vector<GroupBlock>& blocks, std::size_t worker,
                  SumSink& sink) override;

 private:
  /// Working memory of one thread: the points of a block, sorted by class.
  struct alignas(kThreadsApart) Workspace {
    std::vector<LocalPoint> points;
    std::vector<float> weights;  ///< of the points, if they have any
  };
  /// The position of the first point of each class.
  using ClassBegins = std::array<std::uint32_t, kMaxClasses + 3>;

  /// Copies the points of a block to the workspace, sorted by class. @return their number.
  std::size_t sortByClass(std::size_t block, Workspace& workspace, ClassBegins& begin) const;
  void sumBlock(std::size_t block, Workspace& workspace, BlockSums& sums) const;
  /// Opens the plane of a class and sets it to the sums of the points.
  void sumClass(ClassId label, const PointRun* runs, std::size_t count, BlockSums& sums) const;
  /// Prefetches the points of a block.
  void prefetch(std::size_t block) const;

  VoxelKernel kernel_;
  const PointKernels& kernels_;
  ClassSet confined_;
  PointBins bins_;
  bool reports_voxels_;
  std::size_t size_ = 0;
  std::vector<Workspace> workspaces_;
};

}  // namespace bki_mapping
