/// @file Evidence of points: hits, or samples of free space.
#pragma once

#include <vector>

#include "bki_mapping/inference/downsample.h"
#include "bki_mapping/inference/evidence.h"
#include "bki_mapping/inference/kernel.h"

namespace bki_mapping {

/// Adds k(|x - c|) to the class of each point x, for every voxel centre c within the kernel's length; with
/// the counting kernel 1 for the voxel that holds the point.
class PointEvidence : public Evidence {
 public:
  /// @param origin of the points in the map frame [m].
  PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel, const Eigen::Vector3d& origin,
                const LabelledPoints& points);

  /// Exactly the blocks with a voxel centre within reach of a point.
  void collectBlocks(const SemanticMap& map, IndexNumbering& touched) const override;
  void addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const override;

 private:
  /// A point in the coordinates of one block it reaches: [voxels], from the block's first voxel centre.
  struct Entry {
    float x, y, z;
    ClassId label;
  };

  void binPoint(const GridGeometry& geometry, const Eigen::Vector3d& point, ClassId label,
                std::vector<std::uint32_t>& bins, std::vector<Entry>& entries);
  void sortByBin(const std::vector<std::uint32_t>& bins, const std::vector<Entry>& entries);

  VoxelKernel kernel_;
  IndexNumbering blocks_;
  std::vector<std::size_t> begin_;  ///< of each block's entries; one more than blocks
  std::vector<Entry> entries_;      ///< by block, then class, then order of the points
};

}  // namespace bki_mapping
