#include "beams/occlusion.h"

namespace bki_mapping {

const std::vector<GridIndex>& Occlusion::touchedBlocks(const SemanticMap& map, std::size_t most,
                                                       ThreadPool& pool) {
  const double reach = field_->reachMetres();
  listed_.clear();
  listMappedBlocks(map, field_->origin(), range_ + reach, listed_);
  if (extent_ == OcclusionExtent::kAll) {
    walk_.listBlocksAlong(field_->geometry(), field_->beams(), {true, range_}, reach, most, pool, listed_);
  }
  touched_.clear();
  for (const GridIndex& block : listed_) touched_.insert(block);
  return touched_.members();
}

void Occlusion::reserve(std::size_t workers) {
  workspaces_.resize(workers);
  for (Workspace& each : workspaces_) {
    field_->reserve(each.near);
    each.near.beams.reserve(field_->beams().ends.size());
  }
}

void Occlusion::apply(const GroupBlock& block, std::size_t worker, Block& to) {
  Block::Occlusion beyond, crossed;
  const auto range = static_cast<float>(range_);
  field_->forEachVoxelNear(block.index, range_, workspaces_[worker].near,
                           [&](int offset, float rho, float length) {
                             const auto voxel = static_cast<std::size_t>(offset);
                             if (rho >= 1.0f && rho * length <= range) beyond.set(voxel);
                             if (rho > 0.0f && rho < 1.0f) crossed.set(voxel);
                           });
  to.setOcclusion((to.occlusion() | beyond) & ~crossed);
}

}  // namespace bki_mapping
