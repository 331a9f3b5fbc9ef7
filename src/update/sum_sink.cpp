#include "update/sum_sink.h"

namespace bki_mapping {

VoxelMask SumSink::applyRulesToFree(const GroupBlock& block) {
  const std::size_t slot = block.slot_;
  const VoxelMask& is_protected = work_.protected_[slot];
  if (!work_.rules_.asksBelow()) {
    return applyToFree(work_.rules_, *work_.limits_, is_protected, 0, work_.sums_, nullptr);
  }
  const bool has_below = slot >= kSlotsOfLayer, has_above = slot + kSlotsOfLayer < kGroupBlocks;
  const std::uint64_t below = has_below ? work_.reached_top_[slot - kSlotsOfLayer] : 0;
  const VoxelMask reached = applyToFree(work_.rules_, *work_.limits_, is_protected, below, work_.sums_,
                                        has_below ? nullptr : block.seam_);
  work_.reached_top_[slot] = bitsOf(reached)[kBlockEdge - 1];
  if (!has_above) block.seam_->reached_top = work_.reached_top_[slot];
  return reached;
}

void SumSink::addSums(const GroupBlock& to) {
  if (kind_ == Kind::kHits) {
    applyToHits(work_.rules_, *work_.limits_, work_.sums_, work_.protected_[to.slot_]);
    if (work_.rules_.seeksVoids()) {
      noteHits(work_.rules_, *work_.limits_, work_.sums_, *to.seen_, work_.hit_[to.slot_]);
      to.seen_->hit = work_.sums_.occupied;
    }
  } else {
    const VoxelMask reached = applyRulesToFree(to);
    if (work_.rules_.seeksVoids()) to.seen_->crossed = reached & ~work_.hit_[to.slot_];
  }
  const auto add = work_.withdraws_ ? work_.kernels_->withdraw : work_.kernels_->add;
  for (const BlockSums::Plane& sums : work_.sums_) {
    Block::Layers layers = sums.layers;
    if (!work_.withdraws_) {  // withdrawing also counts what was negative before
      // Planes are in no cache near the core: what is left out is not fetched. On average it is half of them.
      layers = work_.kernels_->find_layers(sums.values, layers);
      if (layers.begin == layers.end) continue;
      if (work_.rules_.keeps_looks) to.seen_->adds = true;
    }
    to.block_->change(sums.label,
                      [&](EvidenceUnits* plane) { return add(sums.values, layers, plane, work_.counts_); });
  }
}

}  // namespace bki_mapping
