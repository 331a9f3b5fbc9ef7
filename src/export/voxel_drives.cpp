#include "export/voxel_drives.h"

#include <algorithm>

namespace bki_mapping {
namespace {

using Sums = std::array<std::int64_t, kBlockVoxels>;

/// Adds the evidence of each voxel: for classes if it is occupied, for all and `free` otherwise.
void addEvidence(const Block& block, const BlockView& view, std::int64_t sign, Sums& sums) {
  for (std::size_t p = 0; p < block.classes().size(); ++p) {
    const EvidenceUnits* const units = block.plane(p);
    const bool free = block.classes()[p] == kFreeClass;
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      if (free && view.state[v] == VoxelState::kOccupied) continue;
      sums[v] += sign * std::max(units[v], 0);
    }
  }
}

}  // namespace

VoxelDrives::VoxelDrives(const std::vector<DriveRecord>& drives, MapFile* file) : file_(file) {
  if (drives.size() > 255) return;
  drives_ = drives;
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    drives_of_part_[file ? drives_[d].part : 0].push_back(d);
  }
}

void VoxelDrives::readTile(const GridIndex& tile) {
  tile_.clear();
  for (const auto& [part, drives] : drives_of_part_) {
    if (part == 0) continue;
    SemanticMap map = file_->info().emptyMap();
    if (file_->addTileTo(map, {tile, part})) tile_.emplace(part, std::move(map));
  }
}

VoxelDrives::Codes VoxelDrives::codesOf(const GridGeometry& geometry, const BlockIndex& index,
                                        const Block& block, const BlockView& view) const {
  Sums rest{}, most{};
  addEvidence(block, view, 1, rest);
  std::array<int, kBlockVoxels> part_of{};
  for (const auto& [part, map] : tile_) {
    const Block* const own = map.find(index);
    if (!own) continue;
    Sums sums{};
    addEvidence(*own, view, 1, sums);
    addEvidence(*own, view, -1, rest);
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      if (sums[v] <= most[v]) continue;
      most[v] = sums[v];
      part_of[v] = part;
    }
  }
  Codes codes{};
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    if (std::max(rest[v], most[v]) <= 0) continue;
    const auto group = drives_of_part_.find(rest[v] > most[v] ? 0 : part_of[v]);
    if (group == drives_of_part_.end()) continue;
    const Eigen::Vector3d centre = geometry.voxelCentre(GridGeometry::voxelOf(index, static_cast<int>(v)));
    int candidates = 0;
    for (const std::size_t d : group->second) {
      if (group->first != 0 && group->second.size() == 1) {
        candidates = 1;
        codes[v] = static_cast<std::uint8_t>(d + 1);
      } else if (drives_[d].bounds.contains(centre)) {
        ++candidates;
        codes[v] = static_cast<std::uint8_t>(d + 1);
      }
    }
    if (candidates != 1) codes[v] = kNotKnown;
  }
  return codes;
}

}  // namespace bki_mapping
