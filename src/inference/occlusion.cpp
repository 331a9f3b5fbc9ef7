#include "bki_mapping/inference/occlusion.h"

#include "bki_mapping/inference/block_walk.h"

namespace bki_mapping {

void Occlusion::collectBlocks(const SemanticMap& map, IndexNumbering& touched) const {
  const Beams& beams = field_->beams();
  insertMappedBlocks(map, beams.origin, range_ + field_->reachMetres(), touched);
  if (extent_ != OcclusionExtent::kAll) return;
  std::vector<Segment> segments;
  segments.reserve(beams.ends.size());
  for (const Eigen::Vector3f& end : beams.ends) {
    const Eigen::Vector3d e = end.cast<double>();
    segments.push_back({beams.origin + e, beams.origin + e * (range_ / e.norm())});
  }
  insertBlocksAlong(field_->geometry(), segments, field_->reachMetres(), touched);
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
