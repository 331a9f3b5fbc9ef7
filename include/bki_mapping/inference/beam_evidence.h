/// @file Free space as whole beam lines.
#pragma once

#include <memory>

#include "bki_mapping/inference/beam_field.h"

namespace bki_mapping {

/// Adds sum over beams of w(rho) k(d) to `free`: d is the distance of the voxel's centre to the beam's line,
/// rho its projection on the beam / beam length, w the weight along the beam, 0 unless 0 < rho < 1.
class BeamEvidence : public Evidence {
 public:
  BeamEvidence(std::shared_ptr<const BeamField> field, BeamWeight weight, FreeSpaceExtent extent)
      : field_(std::move(field)), weight_(weight), extent_(extent) {}

  void collectBlocks(const SemanticMap& map, IndexNumbering& touched) const override;
  void addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const override;

 private:
  std::shared_ptr<const BeamField> field_;
  BeamWeight weight_;
  FreeSpaceExtent extent_;
};

}  // namespace bki_mapping
