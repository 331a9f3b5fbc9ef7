/// @file Evidence of hits with soft labels.
#pragma once

#include <vector>

#include "bki_mapping/core/soft_labels.h"
#include "kernel/sparse_kernel.h"
#include "points/downsample.h"
#include "update/evidence.h"

namespace bki_mapping {

/// Like PointEvidence, but each point adds share * k(|x - c|) to each of its classes. Only for hits; slower.
class SoftPointEvidence : public Evidence {
 public:
  /// @param reports_voxels as in PointEvidence.
  SoftPointEvidence(const GridGeometry& geometry, const KernelConfig& kernel, bool reports_voxels)
      : geometry_(geometry), kernel_(kernel, geometry.resolution()), reports_voxels_(reports_voxels) {}

  /// Replaces the points. @param origin of the points in the map frame [m]. @param soft their shares.
  void setPoints(const Eigen::Vector3d& origin, const LabelledPoints& points, const SoftLabels& soft);

  /// Exactly the blocks that have a voxel centre within reach of a point and, if voxels are reported, those
  /// that contain a point.
  const std::vector<GridIndex>& touchedBlocks(const SemanticMap& map, std::size_t most,
                                              ThreadPool& pool) override;
  void markClasses(std::size_t position, ClassSet& classes) const override;
  void reserve(std::size_t) override {}
  void accumulate(const BlockGroup& group, const std::vector<GroupBlock>& blocks, std::size_t worker,
                  SumSink& sink) override;

 private:
  struct Record {
    LocalPoint point;  ///< labelled with the class of the share
    float share;
  };

  /// Stores a point in every block that it reaches.
  void bin(const Eigen::Vector3d& point, const ClassShare* begin, const ClassShare* end);
  void sumRecord(const Record& record, float* sums) const;
  void sumBlock(const std::vector<Record>& records, BlockSums& sums) const;

  GridGeometry geometry_;
  VoxelKernel kernel_;
  bool reports_voxels_;
  IndexNumbering blocks_;
  std::vector<std::vector<Record>> records_;  ///< of each block, sorted by class
};

}  // namespace bki_mapping
