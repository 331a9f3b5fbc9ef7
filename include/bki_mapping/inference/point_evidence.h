/// @file Evidence of points: hits, or samples of free space.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bki_mapping/inference/downsample.h"
#include "bki_mapping/inference/evidence.h"
#include "bki_mapping/inference/inner_loops.h"
#include "bki_mapping/inference/kernel.h"
#include "bki_mapping/inference/local_point.h"

namespace bki_mapping {

/// Adds k(|x - c|) to the class of each point x, for every voxel centre c within the kernel's length; with
/// the counting kernel 1 for the voxel that holds the point. Keeps its memory from scan to scan.
class PointEvidence : public Evidence {
 public:
  /// @param instruction_set one of instructionSets(); the best there is if empty.
  /// @throws std::invalid_argument if the kernel is longer than 72 voxels.
  PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel,
                const std::string& instruction_set = "");

  /// Replaces the points. @param origin of the points in the map frame [m].
  void setPoints(const Eigen::Vector3d& origin, const LabelledPoints& points, Workers& workers);
  /// The same, of points that a down-sampler has merged.
  void setPoints(const Eigen::Vector3d& origin, const Downsampler& points, Workers& workers);
  std::size_t size() const { return size_; }  ///< number of points

  /// Whether evidence for `free` that stands behind this one leaves the voxels alone that hold a point.
  void protectVoxels(bool protect) { protect_ = protect; }
  /// The same for voxels to which a point adds evidence.
  void protectEvidence(bool protect) { protect_evidence_ = protect; }

  /// Exactly the blocks with a voxel centre within reach of a point.
  void collectBlocks(const SemanticMap& map, Workers& workers, IndexNumbering& touched) override;
  void addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const override;

 private:
  /// Blocks are spread over this many partitions by a hash, so that each can be sorted by one thread.
  static constexpr std::size_t kPartitions = 64;

  struct Record {
    GridIndex block;
    LocalPoint point;
  };
  using Chunk = std::array<std::vector<Record>, kPartitions>;
  struct Partition {
    IndexNumbering blocks;
    std::vector<std::uint32_t> begin;  ///< of each block's points; one more than blocks
    std::vector<LocalPoint> points;    ///< by block, then in the order of the scan
    std::vector<std::uint32_t> block_of_record;
  };

  static std::size_t partitionOf(const GridIndex& block) { return GridIndexHash()(block) >> 58; }
  void bin(const Eigen::Vector3d& point, ClassId label, Chunk& chunk) const;
  /// Clears the given number of chunks for bin.
  void start(std::size_t points, std::size_t chunks);
  void sort(std::size_t partition, std::size_t chunks);
  /// The sums of points of one class.
  void addPoints(const LocalPoint* points, std::size_t count, float* sums) const;

  GridGeometry geometry_;
  double per_metre_;  ///< voxels
  VoxelKernel kernel_;
  const InnerLoops& loops_;
  bool protect_ = false, protect_evidence_ = false;
  std::size_t size_ = 0;
  std::vector<Chunk> chunks_;
  std::array<Partition, kPartitions> partitions_;
};

}  // namespace bki_mapping
