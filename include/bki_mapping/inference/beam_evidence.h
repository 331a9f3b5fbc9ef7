/// @file Free space as whole beam lines.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "bki_mapping/inference/beam_field.h"
#include "bki_mapping/inference/beam_rows.h"

namespace bki_mapping {

/// Adds sum over beams of w(rho) k(d) to `free`: d is the distance of the voxel's centre to the beam's line,
/// rho its projection on the beam / beam length, w the weight along the beam, 0 unless 0 < rho < 1.
class BeamEvidence : public Evidence {
 public:
  /// @param instruction_set one of instructionSets(); the best there is if empty.
  BeamEvidence(std::shared_ptr<const BeamField> field, BeamWeight weight, FreeSpaceExtent extent,
               const std::string& instruction_set = "")
      : field_(std::move(field)),
        weight_(weight),
        extent_(extent),
        add_rows_(addBeamRowsFor(instruction_set.empty() ? instructionSets().back() : instruction_set)) {}

  void collectBlocks(const SemanticMap& map, IndexNumbering& touched) const override;
  void addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const override;

 private:
  /// Adds the sparse kernel's values to scratch.sums.
  void addLines(const BlockIndex& index, EvidenceScratch& scratch) const;

  std::shared_ptr<const BeamField> field_;
  BeamWeight weight_;
  FreeSpaceExtent extent_;
  AddBeamRows add_rows_;
};

}  // namespace bki_mapping
