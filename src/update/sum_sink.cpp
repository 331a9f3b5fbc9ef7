#include "update/sum_sink.h"

#include <algorithm>

namespace bki_mapping {

void SumSink::reserve(const UpdateRules& rules, std::size_t classes) {
  rules_ = rules;
  not_finite_ = 0;
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
  for (const BlockSums::Plane& plane : sums_) {
    // A rule can leave a plane of zeros, which must not enter the map: a hit that protects its voxel may
    // reach no voxel centre, and all voxels that a beam reaches may be protected.
    const bool all_zero =
        rules_.protectsVoxels() && std::all_of(std::begin(plane.values), std::end(plane.values),
                                               [](float value) { return value == 0.0f; });
    if (!all_zero) not_finite_ += (*targets_)[current_]->add(plane.label, plane.values, plane.layers);
  }
}

}  // namespace bki_mapping
