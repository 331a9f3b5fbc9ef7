#include "update/sum_sink.h"

namespace bki_mapping {

void SumSink::reserve(const UpdateRules& rules, std::size_t classes, bool withdraws) {
  rules_ = rules;
  withdraws_ = withdraws;
  counts_ = {};
  sums_.reserve(classes);
}

void SumSink::startGroup() {
  if (rules_.protectsVoxels()) protected_.fill({});
  if (rules_.seeksVoids()) hit_.fill({});
  if (rules_.asksBelow()) reached_top_.fill(0);
}

void SumSink::startEvidence(Kind kind, const std::vector<int>& slots, const std::vector<Block*>& targets,
                            const std::vector<SeenVoxels*>& seen, const std::vector<BlockSeam*>& seams) {
  kind_ = kind;
  slots_ = &slots;
  targets_ = &targets;
  seen_ = &seen;
  seams_ = &seams;
}

VoxelMask SumSink::applyRulesToFree(std::size_t slot) {
  if (!rules_.asksBelow()) return applyToFree(rules_, *kernels_, protected_[slot], 0, sums_, nullptr);
  const bool has_below = slot >= kSlotsOfLayer, has_above = slot + kSlotsOfLayer < kGroupBlocks;
  BlockSeam& seam = *(*seams_)[current_];
  const VoxelMask reached =
      applyToFree(rules_, *kernels_, protected_[slot], has_below ? reached_top_[slot - kSlotsOfLayer] : 0,
                  sums_, has_below ? nullptr : &seam);
  reached_top_[slot] = bitsOf(reached)[kBlockEdge - 1];
  if (!has_above) seam.reached_top = reached_top_[slot];
  return reached;
}

void SumSink::close() {
  const auto slot = static_cast<std::size_t>((*slots_)[current_]);
  if (kind_ == Kind::kHits) {
    applyToHits(rules_, *kernels_, sums_, protected_[slot]);
    if (rules_.seeksVoids()) noteHits(rules_, *kernels_, sums_, *(*seen_)[current_], hit_[slot]);
  } else {
    const VoxelMask reached = applyRulesToFree(slot);
    if (rules_.seeksVoids()) (*seen_)[current_]->crossed = reached & ~hit_[slot];
  }
  const auto add = withdraws_ ? kernels_->withdraw : kernels_->add;
  for (const BlockSums::Plane& sums : sums_) {
    (*targets_)[current_]->change(
        sums.label, [&](EvidenceUnits* plane) { return add(sums.values, sums.layers, plane, counts_); });
  }
}

}  // namespace bki_mapping
