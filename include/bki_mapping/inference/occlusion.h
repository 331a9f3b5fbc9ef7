/// @file Which voxels a scan saw only behind its hits.
#pragma once

#include <memory>

#include "bki_mapping/inference/beam_field.h"

namespace bki_mapping {

/// Marks the voxels that lie behind the end of some beam (rho >= 1) and that no beam of this scan crosses
/// (0 < rho < 1). Voxels that this scan does not reach keep the mark of an earlier one.
class Occlusion : public Evidence {
 public:
  /// @param range how far from the sensor shadows are followed [m].
  Occlusion(std::shared_ptr<const BeamField> field, OcclusionExtent extent, double range)
      : field_(std::move(field)), extent_(extent), range_(range) {}

  void collectBlocks(const SemanticMap& map, IndexNumbering& touched) const override;
  void addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const override;

 private:
  std::shared_ptr<const BeamField> field_;
  OcclusionExtent extent_;
  double range_;
};

}  // namespace bki_mapping
