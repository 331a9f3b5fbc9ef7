#include "bki_mapping/inference/beam_evidence.h"

#include <algorithm>

#include "bki_mapping/inference/block_walk.h"

namespace bki_mapping {
namespace {

/// Weight along a beam, 0 unless 0 < rho < 1.
template <BeamWeight kWeight>
float weightAt(float rho) {
  const float inside = rho > 0.0f && rho < 1.0f ? 1.0f : 0.0f;
  if (kWeight == BeamWeight::kUniform) return inside;
  if (kWeight == BeamWeight::kLinear) return inside * rho;
  return std::max(0.0f, std::min(rho, 1.0f - rho));
}

template <BeamWeight kWeight>
void addBeams(const BeamField& field, const BlockIndex& index, EvidenceScratch& scratch) {
  const VoxelKernel& kernel = field.kernel();
  float* sums = scratch.sums.data();
  if (kernel.type == KernelType::kCounting) {
    field.forEachVoxelNear(index, 0.0, scratch.beams,
                           [&](int offset, float rho, float) { sums[offset] += weightAt<kWeight>(rho); });
    return;
  }
  field.forEachBeamNear(index, 0.0, scratch.beams, [&](const LocalBeam& beam, const Eigen::Vector3f&) {
    forEachNearRow(beam, field.reach(), [&](const NearRow& row) {
      float* out = sums + row.offset;
      for (int i = 0; i < kBlockEdge; ++i) {
        const float dx = static_cast<float>(i) - row.x;
        const float t = (row.distance2 + beam.g * dx * dx) * kernel.inverse_reach2;
        out[i] += weightAt<kWeight>(row.rho + static_cast<float>(i) * row.rho_step) * sparseKernel(t) *
                  kernel.scale;
      }
    });
  });
}

}  // namespace

void BeamEvidence::collectBlocks(const SemanticMap& map, IndexNumbering& touched) const {
  const Beams& beams = field_->beams();
  if (extent_ == FreeSpaceExtent::kMapped) {
    insertMappedBlocks(map, beams.origin, field_->longest() + field_->reachMetres(), touched);
    return;
  }
  for (const Eigen::Vector3f& end : beams.ends) {
    insertBlocksAlong(field_->geometry(), beams.origin, beams.origin + end.cast<double>(),
                      field_->reachMetres(), touched);
  }
}

void BeamEvidence::addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const {
  scratch.sums.fill(0.0f);
  switch (weight_) {
    case BeamWeight::kUniform:
      addBeams<BeamWeight::kUniform>(*field_, index, scratch);
      break;
    case BeamWeight::kLinear:
      addBeams<BeamWeight::kLinear>(*field_, index, scratch);
      break;
    case BeamWeight::kBilinear:
      addBeams<BeamWeight::kBilinear>(*field_, index, scratch);
      break;
  }
  const bool any = std::any_of(scratch.sums.begin(), scratch.sums.end(), [](float s) { return s > 0.0f; });
  if (any) block.add(kFreeClass, scratch.sums.data());
}

}  // namespace bki_mapping
