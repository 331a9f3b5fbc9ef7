#include "bki_mapping/inference/beam_evidence.h"

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

const std::vector<GridIndex>& BeamEvidence::collectBlocks(const SemanticMap& map, Workers& workers) {
  const double reach = field_->reachMetres();
  touched_.clear();
  if (extent_ == FreeSpaceExtent::kMapped) {
    insertMappedBlocks(map, field_->origin(), field_->longest() + reach, touched_);
  } else {
    walk_.insertBlocksAlong(field_->geometry(), field_->beams(), BeamPiece(), reach, workers, touched_);
  }
  return touched_.members();
}

void BeamEvidence::addTo(std::size_t, const BlockIndex& index, Block& block, EvidenceScratch& scratch) const {
  float* sums = scratch.sums.data();
  scratch.sums.fill(0.0f);
  if (field_->kernel().type == KernelType::kCounting) {
    field_->forEachVoxelNear(index, 0.0, scratch,
                             [&](int offset, float rho, float) { sums[offset] += weightAt(weight_, rho); });
  } else if (field_->hasTable()) {
    loops_.add_beams(field_->arrays(), field_->blockAt(index), weight_, sums);
  } else {
    field_->findRangesNear(index, scratch);
    loops_.add_some_beams(field_->arrays(), scratch.ranges.data(), scratch.ranges.size(),
                          field_->blockAt(index), weight_, sums);
  }
  scratch.leaveHeldAlone();
  if (scaleAndLimit(field_->kernel().scale, scratch.limits.free, sums)) block.add(kFreeClass, sums);
}

}  // namespace bki_mapping
