#include "bki_mapping/inference/occlusion.h"

namespace bki_mapping {

void Occlusion::collectBlocks(const SemanticMap& map, Workers& workers, IndexNumbering& touched) {
  const double reach = field_->reachMetres();
  insertMappedBlocks(map, field_->origin(), range_ + reach, touched);
  if (extent_ != OcclusionExtent::kAll) return;
  walk_.insertBlocksAlong(field_->geometry(), field_->beams(), {true, range_}, reach, workers, touched);
}

void Occlusion::addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const {
  Block::Occlusion behind, crossed;
  const auto range = static_cast<float>(range_);
  field_->forEachVoxelNear(index, range_, scratch, [&](int offset, float rho, float length) {
    const auto voxel = static_cast<std::size_t>(offset);
    if (rho >= 1.0f && rho * length <= range) behind.set(voxel);
    if (rho > 0.0f && rho < 1.0f) crossed.set(voxel);
  });
  block.setOcclusion((block.occlusion() | behind) & ~crossed);
}

}  // namespace bki_mapping
