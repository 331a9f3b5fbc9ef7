#include "beams/line_evidence.h"

#include <algorithm>

namespace bki_mapping {
namespace {

float weightAt(BeamWeight weight, float rho) {
  if (!(rho > 0.0f && rho < 1.0f)) return 0.0f;
  switch (weight) {
    case BeamWeight::kLinear:
      return rho;
    case BeamWeight::kBilinear:
      return std::min(rho, 1.0f - rho);
    default:
      return 1.0f;
  }
}

/// @return whether anything is left. (Written so that compilers use vector instructions.)
bool scaleAndLimit(float scale, float limit, float* sums) {
  unsigned some = 0;
  for (int v = 0; v < kBlockVoxels; ++v) {
    const float sum = sums[v] * scale, limited = sum < limit ? sum : limit;
    sums[v] = limited > 0.0f ? limited : 0.0f;  // the kernel's tail may be a little below 0
    some |= limited > 0.0f ? 1u : 0u;
  }
  return some != 0;
}

}  // namespace

void LineEvidence::setField(const BeamField& field, ThreadPool& pool) {
  field_ = &field;
  if (field.kernel().type == KernelType::kCounting) return;
  tracks_.set(field.beams(), field.geometry().resolution(), field.reachMetres(), loops_, pool);
}

const std::vector<GridIndex>& LineEvidence::collectBlocks(const SemanticMap& map, std::size_t most,
                                                          ThreadPool& pool) {
  const double reach = field_->reachMetres();
  touched_.clear();
  if (extent_ == FreeSpaceExtent::kMapped) {
    insertMappedBlocks(map, field_->origin(), field_->longest() + reach, touched_);
  } else {
    walk_.insertBlocksAlong(field_->geometry(), field_->beams(), BeamPiece(), reach, most, pool, touched_);
  }
  return touched_.members();
}

void LineEvidence::reserve(EvidenceScratch& scratch) const {
  field_->reserve(scratch);
  if (field_->kernel().type == KernelType::kSparse) scratch.group.reserve(field_->beams().ends.size());
}

double LineEvidence::effort(const BlockGroup& group) const {
  // As many beams as the group is large, seen from the sensor.
  return 1.0 / std::max(field_->boxOf(group).centre().squaredNorm(), BeamBox::kHalf * BeamBox::kHalf);
}

void LineEvidence::enter(const BlockGroup& group, EvidenceScratch& scratch) const {
  if (field_->kernel().type == KernelType::kCounting) return;
  field_->findRangesNear(group, scratch);
  loops_.trace_beams(tracks_.arrays(), scratch.ranges.data(), scratch.ranges.size(), field_->boxOf(group),
                     weight_, scratch.group);
}

void LineEvidence::addTo(std::size_t, const BlockIndex& index, Block& block, EvidenceScratch& scratch) const {
  float* sums = scratch.sums.data();
  if (field_->kernel().type == KernelType::kCounting) {
    scratch.sums.fill(0.0f);
    field_->forEachVoxelNear(index, 0.0, scratch,
                             [&](int offset, float rho, float) { sums[offset] += weightAt(weight_, rho); });
  } else {
    scratch.group.sumsOf({placeInGroup(index.x), placeInGroup(index.y), placeInGroup(index.z)}, sums);
  }
  scratch.leaveHeldAlone();
  if (scaleAndLimit(field_->kernel().scale, scratch.limits.free, sums)) {
    scratch.not_finite += block.add(kFreeClass, sums);
  }
}

}  // namespace bki_mapping
