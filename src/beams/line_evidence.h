/// @file Free space as whole beam lines.
#pragma once

#include <string>

#include "beams/beam_field.h"
#include "beams/block_walk.h"
#include "simd/inner_loops.h"

namespace bki_mapping {

/// Adds sum over beams of w(rho) k(d) to `free`: d is the distance of the voxel's centre to the beam's line,
/// rho its projection on the beam / beam length, w the weight along the beam, 0 unless 0 < rho < 1.
class LineEvidence : public Evidence {
 public:
  /// @param instruction_set one of instructionSets(); the best there is if empty.
  LineEvidence(BeamWeight weight, FreeSpaceExtent extent, const std::string& instruction_set = "")
      : weight_(weight), extent_(extent), loops_(innerLoopsFor(instruction_set)) {}

  /// Replaces the beams. @param field must stay where it is until the scan is done.
  void setField(const BeamField& field, ThreadPool& pool);

  const std::vector<GridIndex>& collectBlocks(const SemanticMap& map, std::size_t most,
                                              ThreadPool& pool) override;
  void markClasses(std::size_t, ClassSet& classes) const override { classes.set(kFreeClass); }
  void reserve(EvidenceScratch& scratch) const override;
  double effort(const BlockGroup& group) const override;
  void enter(const BlockGroup& group, EvidenceScratch& scratch) const override;
  void addTo(std::size_t number, const BlockIndex& index, Block& block,
             EvidenceScratch& scratch) const override;

 private:
  const BeamField* field_ = nullptr;
  BeamWeight weight_;
  FreeSpaceExtent extent_;
  const InnerLoops& loops_;
  BeamTracks tracks_;
  BlockWalk walk_;
  IndexNumbering touched_;
};

}  // namespace bki_mapping
