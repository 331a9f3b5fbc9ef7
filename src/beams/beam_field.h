/// @file The beams of a scan with their index, and the voxels near them.
#pragma once

#include <memory>
#include <vector>

#include "beams/beam_index.h"
#include "beams/beams.h"
#include "beams/raster/beam_box.h"
#include "beams/row_walk.h"
#include "bki_mapping/core/grid_geometry.h"
#include "kernel/sparse_kernel.h"
#include "map/block_group.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// Working memory of one thread: beams near a block or a group.
struct NearBeams {
  std::vector<BeamRange> ranges;
  std::vector<std::uint32_t> beams;
};

/// The part that line evidence and occlusion have in common: the beams, their index, and which voxels they
/// reach. With the sparse kernel a beam reaches the voxels whose centre is within the support radius; with
/// the counting kernel it reaches those that it crosses. Keeps its memory from scan to scan.
class BeamField {
 public:
  BeamField(const GridGeometry& geometry, const KernelConfig& kernel, BeamIndexType index);

  /// Replaces the beams.
  void setBeams(const Beams& beams, ThreadPool& pool);

  const GridGeometry& geometry() const { return geometry_; }
  const VoxelKernel& kernel() const { return kernel_; }
  const Eigen::Vector3d& origin() const { return beams_.origin; }
  /// In the order of the index.
  const Beams& beams() const { return beams_; }
  BeamBox boxOf(const BlockGroup& group) const;
  /// Those of a direction bin.
  BeamRange beamsIn(std::size_t cell) const { return {table_.begin()[cell], table_.begin()[cell + 1]}; }
  std::uint32_t cellOf(std::size_t beam) const { return sorted_cells_[beam]; }     ///< direction bin
  float inverseLengthOf(std::size_t beam) const { return inverse_length_[beam]; }  ///< [1 / m]

  /// The greatest distance from a beam at which it reaches a voxel centre [m].
  double reachMetres() const { return reach_ * geometry_.resolution(); }
  double longest() const { return longest_; }  ///< length of the longest beam [m]

  /// Allocates the memory that the searches below can need.
  void reserve(NearBeams& near) const;

  /// Sets near.ranges to sorted, disjoint ranges that include all beams whose half-lines reach the block.
  void findRangesNear(const BlockIndex& index, NearBeams& near) const;

  /// The same for the blocks of a group.
  void findRangesNear(const BlockGroup& group, NearBeams& near) const;

  /// Sets `ranges` to those of the beams in the window of a voxel. @param voxel of the layer. @param ranges
  /// room for BeamTable::kMostRanges. @return their number.
  std::size_t rangesIn(const CellWindows& windows, int voxel, BeamRange* ranges) const;

  /// Calls visit(offset, rho, length) for every beam and every voxel of the block that its line reaches,
  /// where rho is the projection of the voxel's centre on the beam, and length the beam's length [m].
  /// @param follow distance from the sensor up to which lines are followed past the ends of beams [m].
  template <typename Visit>
  void forEachVoxelNear(const BlockIndex& index, double follow, NearBeams& near, Visit&& visit) const;

 private:
  /// Finds the beams whose half-lines may pass through a ball. @param centre relative to the sensor [m].
  /// @param radius [m].
  void findRangesNear(const Eigen::Vector3d& centre, double radius, NearBeams& near) const;
  /// Sets near.beams to the beams that may reach the block.
  void findBeamsNear(const BlockIndex& index, double follow, NearBeams& near) const;
  /// A beam in the coordinates of a block.
  LocalBeam localBeam(std::size_t beam, const BlockIndex& index) const;
  /// Whether a beam's half-line crosses a voxel: the test of the counting kernel.
  bool crosses(const BlockIndex& index, int offset, const Eigen::Vector3f& end) const;

  GridGeometry geometry_;
  VoxelKernel kernel_;
  BeamIndexType index_type_;
  float reach_;  ///< [voxels]
  double longest_ = 0.0;
  Beams beams_;
  std::vector<float> inverse_length_;  ///< [1 / m]
  BeamTable table_;
  std::unique_ptr<BeamIndex> rtree_;
  std::vector<std::uint32_t> cells_, order_, sorted_cells_;
};

/// The beams of a scan; builds their field on first use.
class LazyBeamField {
 public:
  LazyBeamField(const GridGeometry& geometry, const KernelConfig& kernel, BeamIndexType index)
      : field_(geometry, kernel, index) {}

  /// Replaces the beams, which must stay valid until the scan is done.
  void setBeams(const Beams& beams) {
    beams_ = &beams;
    ready_ = false;
  }
  const Beams& beams() const { return *beams_; }
  const BeamField& field(ThreadPool& pool) {
    if (!ready_) field_.setBeams(*beams_, pool);
    ready_ = true;
    return field_;
  }

 private:
  BeamField field_;
  const Beams* beams_ = nullptr;
  bool ready_ = false;
};

template <typename Visit>
void BeamField::forEachVoxelNear(const BlockIndex& index, double follow, NearBeams& near,
                                 Visit&& visit) const {
  const bool counting = kernel_.type == KernelType::kCounting;
  findBeamsNear(index, follow, near);
  for (const std::uint32_t b : near.beams) {
    const LocalBeam local = localBeam(b, index);
    const Eigen::Vector3f& end = beams_.ends[b];
    const float length = end.norm();
    forEachNearRow(local, reach_, [&](const NearRow& row) {
      for (int i = 0; i < kBlockEdge; ++i) {
        const float dx = static_cast<float>(i) - row.x;
        const float d2 = row.distance2 + local.g * dx * dx;
        if (d2 >= reach_ * reach_ || (counting && !crosses(index, row.offset + i, end))) continue;
        visit(row.offset + i, row.rho + static_cast<float>(i) * row.rho_step, length);
      }
    });
  }
}

}  // namespace bki_mapping
