/// @file The beams of a scan, indexed, and the voxels near them.
#pragma once

#include <memory>
#include <utility>

#include "bki_mapping/core/semantic_map.h"
#include "bki_mapping/inference/beam_index.h"
#include "bki_mapping/inference/beam_raster.h"
#include "bki_mapping/inference/beams.h"
#include "bki_mapping/inference/evidence.h"
#include "bki_mapping/inference/kernel.h"

namespace bki_mapping {

/// What line evidence and occlusion share: the beams, their index, and how near a voxel must be. With the
/// sparse kernel a beam reaches the voxels whose centre is within its length; with the counting kernel those
/// that it crosses.
class BeamField {
 public:
  BeamField(const GridGeometry& geometry, const KernelConfig& kernel, BeamIndexType index, Beams beams);

  const GridGeometry& geometry() const { return geometry_; }
  const VoxelKernel& kernel() const { return kernel_; }
  /// In the order of the index.
  const Beams& beams() const { return beams_; }
  /// Radius about a beam outside which no voxel centre is reached, in voxels and in metres.
  float reach() const { return reach_; }
  double reachMetres() const { return reach_ * geometry_.resolution(); }
  double longest() const { return longest_; }  ///< length of the longest beam [m]

  /// Finds the beams that may reach the block between the sensor and their end, or `follow` [m from the
  /// sensor] if that is farther: their numbers in scratch.beams.
  void findBeamsNear(const BlockIndex& index, double follow, EvidenceScratch& scratch) const;

  /// A beam in a block's coordinates, turned so that the given axis (0 x, 1 y, 2 z) comes first: what
  /// LocalBeam calls x, y, z are then the axes `lane`, lane + 1, lane + 2 (mod 3).
  LocalBeam localBeam(std::size_t beam, const BlockIndex& index, int lane) const;
  /// The axis nearest to a beam's direction: along it a row of voxels holds most of those near the beam.
  int laneOf(std::size_t beam) const;

  /// Calls visit(offset, rho, length) for every voxel of the block that the line of such a beam reaches, with
  /// rho the projection of the voxel's centre on the beam / beam length [m].
  template <typename Visit>
  void forEachVoxelNear(const BlockIndex& index, double follow, EvidenceScratch& scratch,
                        Visit&& visit) const;

 private:
  /// Whether a beam's line crosses a voxel of a block (the counting kernel's reach).
  bool crosses(const BlockIndex& index, int offset, const Eigen::Vector3f& end) const;

  GridGeometry geometry_;
  VoxelKernel kernel_;
  Beams beams_;
  float reach_;
  double longest_ = 0.0;
  std::vector<float> ux_, uy_, uz_, length_;  ///< unit directions and lengths [m], for a first look
  std::vector<Eigen::Vector3d> directions_;   ///< the same, exactly
  std::unique_ptr<BeamIndex> index_;
};

/// The beams of a scan, and their field once somebody asks for it.
class LazyBeamField {
 public:
  LazyBeamField(const GridGeometry& geometry, const KernelConfig& kernel, BeamIndexType index, Beams beams)
      : geometry_(geometry), kernel_(kernel), index_(index), beams_(std::move(beams)) {}

  const Beams& beams() const { return beams_; }
  std::shared_ptr<const BeamField> field() {
    if (!field_) field_ = std::make_shared<const BeamField>(geometry_, kernel_, index_, beams_);
    return field_;
  }

 private:
  GridGeometry geometry_;
  KernelConfig kernel_;
  BeamIndexType index_;
  Beams beams_;
  std::shared_ptr<const BeamField> field_;
};

template <typename Visit>
void BeamField::forEachVoxelNear(const BlockIndex& index, double follow, EvidenceScratch& scratch,
                                 Visit&& visit) const {
  const bool counting = kernel_.type == KernelType::kCounting;
  findBeamsNear(index, follow, scratch);
  for (std::size_t b = 0; b < scratch.beams.size(); ++b) {
    const LocalBeam local = localBeam(scratch.beams[b], index, 0);
    const Eigen::Vector3f& end = beams_.ends[scratch.beams[b]];
    forEachNearRow(local, reach_, [&](const NearRow& row) {
      for (int i = 0; i < kBlockEdge; ++i) {
        const float dx = static_cast<float>(i) - row.x;
        const float d2 = row.distance2 + local.g * dx * dx;
        if (d2 >= reach_ * reach_ || (counting && !crosses(index, row.offset + i, end))) continue;
        visit(row.offset + i, row.rho + static_cast<float>(i) * row.rho_step, length_[scratch.beams[b]]);
      }
    });
  }
}

}  // namespace bki_mapping
