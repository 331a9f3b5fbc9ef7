/// @file Evidence of points: hits, or samples of free space.
#pragma once

#include <array>
#include <string>

#include "points/point_bins.h"
#include "update/evidence.h"

namespace bki_mapping {

/// Adds k(|x - c|) to the class of each point x, for every voxel centre c within the kernel's length; with
/// the counting kernel 1 for the voxel that holds the point. Keeps its memory from scan to scan.
class PointEvidence : public Evidence {
 public:
  /// @param instruction_set one of instructionSets(); the best there is if empty.
  /// @throws std::invalid_argument if a sparse kernel is longer than 72 voxels.
  PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel,
                const std::string& instruction_set = "");

  /// Replaces the points. @param points merged, relative to the origin. @param origin in the map frame [m].
  /// @throws TooMuchWork as PointBins.
  void setPoints(const Eigen::Vector3d& origin, const Downsampler& points, ThreadPool& pool);
  std::size_t size() const { return size_; }  ///< number of points

  /// Whether evidence for `free` that stands behind this one leaves the voxels alone that hold a point.
  void protectVoxels(bool protect) { protect_ = protect; }
  /// The same for voxels to which a point adds evidence.
  void protectEvidence(bool protect) { protect_evidence_ = protect; }

  /// Exactly the blocks with a voxel centre within reach of a point.
  const std::vector<GridIndex>& collectBlocks(const SemanticMap& map, std::size_t most,
                                              ThreadPool& pool) override;
  void markClasses(std::size_t number, ClassSet& classes) const override;
  void reserve(EvidenceScratch& scratch) const override;
  void prefetch(std::size_t number) const override;
  void addTo(std::size_t number, const BlockIndex& index, Block& block,
             EvidenceScratch& scratch) const override;

 private:
  /// Where the points of each class end.
  using ClassEnds = std::array<std::uint32_t, kMaxClasses + 3>;
  /// Brings the points of a block into `scratch.points`, class by class. @return how many they are.
  std::size_t sortByClass(std::size_t block, EvidenceScratch& scratch, ClassEnds& end) const;
  void addClass(ClassId label, const PointRun* runs, std::size_t count, bool limited, Block& block,
                EvidenceScratch& scratch) const;
  /// Sets `scratch.sums` to those of the points. @return the layers outside of which all are 0.
  Block::Layers sumPoints(const PointRun* runs, std::size_t count, EvidenceScratch& scratch) const;

  VoxelKernel kernel_;
  const InnerLoops& loops_;
  PointBins bins_;
  bool protect_ = false, protect_evidence_ = false;
  std::size_t size_ = 0;
};

}  // namespace bki_mapping
