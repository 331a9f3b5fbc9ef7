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
  const Beams& beams() const { return beams_; }
  /// Radius about a beam outside which no voxel centre is reached, in voxels and in metres.
  float reach() const { return reach_; }
  double reachMetres() const { return reach_ * geometry_.resolution(); }
  double longest() const { return longest_; }  ///< length of the longest beam [m]

  /// Calls visit(const LocalBeam&, const Eigen::Vector3f& end) for every beam that may reach the block
  /// between the sensor and its end, or `follow` [m from the sensor] if that is farther.
  template <typename Visit>
  void forEachBeamNear(const BlockIndex& index, double follow, std::vector<std::uint32_t>& candidates,
                       Visit&& visit) const;

  /// Calls visit(offset, rho, length) for every voxel of the block that the line of such a beam reaches, with
  /// rho the projection of the voxel's centre on the beam / beam length [m].
  template <typename Visit>
  void forEachVoxelNear(const BlockIndex& index, double follow, std::vector<std::uint32_t>& candidates,
                        Visit&& visit) const;

 private:
  /// Whether a beam's line crosses a voxel of a block (the counting kernel's reach).
  bool crosses(const BlockIndex& index, int offset, const Eigen::Vector3f& end) const;

  GridGeometry geometry_;
  VoxelKernel kernel_;
  Beams beams_;
  float reach_;
  double longest_ = 0.0;
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
void BeamField::forEachBeamNear(const BlockIndex& index, double follow,
                                std::vector<std::uint32_t>& candidates, Visit&& visit) const {
  const double resolution = geometry_.resolution();
  const Eigen::Vector3d centre = geometry_.blockCentre(index) - beams_.origin;
  const auto radius = static_cast<float>((kLatticeRadius + reach_) * resolution);
  index_->query(centre.cast<float>(), radius, candidates);
  LocalBeam local;
  for (const std::uint32_t b : candidates) {
    if (toLocalBeam(centre, beams_.ends[b], resolution, reach_, follow, local)) visit(local, beams_.ends[b]);
  }
}

template <typename Visit>
void BeamField::forEachVoxelNear(const BlockIndex& index, double follow,
                                 std::vector<std::uint32_t>& candidates, Visit&& visit) const {
  const bool counting = kernel_.type == KernelType::kCounting;
  const auto onBeam = [&](const LocalBeam& local, const Eigen::Vector3f& end) {
    const float length = end.norm();
    forEachNearRow(local, reach_, [&](const NearRow& row) {
      for (int i = 0; i < kBlockEdge; ++i) {
        const float dx = static_cast<float>(i) - row.x;
        const float d2 = row.distance2 + local.g * dx * dx;
        if (d2 >= reach_ * reach_ || (counting && !crosses(index, row.offset + i, end))) continue;
        visit(row.offset + i, row.rho + static_cast<float>(i) * row.rho_step, length);
      }
    });
  };
  forEachBeamNear(index, follow, candidates, onBeam);
}

}  // namespace bki_mapping
