#include "update/sum_sink.h"

namespace bki_mapping {

void SumSink::reserve(const UpdateRules& rules, std::size_t classes, bool withdraws) {
  rules_ = rules;
  withdraws_ = withdraws;
  counts_ = {};
  sums_.reserve(classes);
}

void SumSink::startGroup() {
  if (!rules_.protectsVoxels()) return;
  for (VoxelMask& mask : protected_) mask.reset();
}

void SumSink::startEvidence(Kind kind, const std::vector<int>& slots, const std::vector<Block*>& targets) {
  kind_ = kind;
  slots_ = &slots;
  targets_ = &targets;
}

void SumSink::close() {
  VoxelMask& is_protected = protected_[static_cast<std::size_t>((*slots_)[current_])];
  if (kind_ == Kind::kHits) {
    applyToHits(rules_, sums_, is_protected);
  } else {
    applyToFree(rules_, is_protected, sums_);
  }
  const auto add = withdraws_ ? kernels_->withdraw : kernels_->add;
  for (const BlockSums::Plane& sums : sums_) {
    (*targets_)[current_]->change(
        sums.label, [&](EvidenceUnits* plane) { return add(sums.values, sums.layers, plane, counts_); });
  }
}

}  // namespace bki_mapping
