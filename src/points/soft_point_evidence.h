/// @file Evidence of hits whose class is not sure.
#pragma once

#include <vector>

#include "bki_mapping/core/soft_labels.h"
#include "kernel/sparse_kernel.h"
#include "points/downsample.h"
#include "update/evidence.h"

namespace bki_mapping {

/// As PointEvidence, but each point adds to each of its classes: share * k(|x - c|). For hits alone; not as
/// fast.
class SoftPointEvidence : public Evidence {
 public:
  SoftPointEvidence(const GridGeometry& geometry, const KernelConfig& kernel)
      : geometry_(geometry), kernel_(kernel, geometry.resolution()) {}

  /// Replaces the points. @param origin of the points in the map frame [m]. @param soft one set a point.
  void setPoints(const Eigen::Vector3d& origin, const LabelledPoints& points, const SoftLabels& soft);
  /// Whether evidence for `free` that stands behind this one leaves the voxels alone that hold a point.
  void protectVoxels(bool protect) { protect_ = protect; }
  /// The same for voxels to which a point adds evidence.
  void protectEvidence(bool protect) { protect_evidence_ = protect; }

  /// Exactly the blocks with a voxel centre within reach of a point, or, if protected, with a point.
  const std::vector<GridIndex>& collectBlocks(const SemanticMap& map, std::size_t most,
                                              ThreadPool& pool) override;
  void markClasses(std::size_t number, ClassSet& classes) const override;
  void reserve(EvidenceScratch&) const override {}
  void addTo(std::size_t number, const BlockIndex& index, Block& block,
             EvidenceScratch& scratch) const override;

 private:
  struct Record {
    LocalPoint point;  ///< its label is the class
    float share;
  };

  void bin(const Eigen::Vector3d& point, const ClassShare* begin, const ClassShare* end);
  void addRecord(const Record& record, float* sums) const;

  GridGeometry geometry_;
  VoxelKernel kernel_;
  bool protect_ = false, protect_evidence_ = false;
  IndexNumbering blocks_;
  std::vector<std::vector<Record>> records_;  ///< of each block, by class
};

}  // namespace bki_mapping
