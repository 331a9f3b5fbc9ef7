#include "evaluation/occupants.h"

namespace bki_mapping {
namespace {

Occupant occupantOfView(const VoxelView& view) {
  Occupant occupant{view.state, view.label, std::nullopt};
  if (view.evidence > 0.0f) occupant.occupancy = static_cast<double>(view.occupancy);
  return occupant;
}

}  // namespace

std::optional<ClassId> MapOccupants::at(const VoxelIndex& voxel) {
  const BlockIndex index = GridGeometry::blockOf(voxel);
  const Block* const block = map_.find(index);
  if (!block) return std::nullopt;
  const auto fresh = static_cast<std::uint32_t>(views_.size());
  const std::uint32_t n = view_of_.insert(index, fresh);
  if (n == fresh) {
    views_.emplace_back();
    readBlock(map_, rules_, index, *block, BlockFields::kStates, views_.back());
  }
  const auto offset = static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel));
  if (views_[n].state[offset] != VoxelState::kOccupied) return std::nullopt;
  return views_[n].label[offset];
}

Occupant MapOccupants::occupantOf(const VoxelIndex& voxel) const {
  return occupantOfView(viewWithoutEntropy(map_, rules_, voxel));
}

void MapOccupants::forEachKnown(const Visit& visit) const {
  forEachKnownVoxel(map_, rules_, [&](const VoxelIndex& voxel, const VoxelView& view) {
    visit(voxel, occupantOfView(view));
  });
}

}  // namespace bki_mapping
