#include "bki_mapping/map/semantic_map.h"

#include <algorithm>
#include <array>
#include <utility>

namespace bki_mapping {
namespace {

using Voxels = Block::Occlusion;  ///< a set of voxels of a block

/// The voxels of a block whose centres lie in a box.
Voxels voxelsIn(const Eigen::AlignedBox3d& box, const BlockIndex& index, const GridGeometry& geometry) {
  std::array<std::array<bool, kBlockEdge>, 3> inside;  // between the faces across each axis
  for (int n = 0; n < kBlockEdge; ++n) {
    const auto position = static_cast<std::size_t>(n);
    const VoxelIndex on_diagonal =
        GridGeometry::voxelOf(index, n * (1 + kBlockEdge + kBlockEdge * kBlockEdge));
    const Eigen::Vector3d centre = geometry.voxelCentre(on_diagonal);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      inside[static_cast<std::size_t>(axis)][position] =
          centre[axis] >= box.min()[axis] && centre[axis] <= box.max()[axis];
    }
  }
  Voxels voxels;
  for (const auto& along : inside) {
    if (std::none_of(along.begin(), along.end(), [](bool in) { return in; })) return voxels;
  }
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    voxels[v] = inside[0][v % kBlockEdge] && inside[1][v / kBlockEdge % kBlockEdge] &&
                inside[2][v / kBlockEdge / kBlockEdge];
  }
  return voxels;
}

bool holdsAnything(const Block& block, const Voxels& voxels) {
  if ((block.occlusion() & voxels).any()) return true;
  for (std::size_t p = 0; p < block.classes().size(); ++p) {
    const EvidenceUnits* const plane = block.plane(p);
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      if (plane[v] != 0 && voxels[v]) return true;
    }
  }
  return false;
}

void clear(Block& block, const Voxels& voxels) {
  const ClassList classes = block.classes();
  for (const ClassId id : classes) {
    block.change(id, [&](EvidenceUnits* plane) {
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        if (voxels[v]) plane[v] = 0;
      }
      return false;
    });
  }
  block.setOcclusion(block.occlusion() & ~voxels);
  block.looks().erase(voxels);
}

}  // namespace

std::vector<GridIndex> clearBox(SemanticMap& map, const Eigen::AlignedBox3d& box) {
  std::vector<std::pair<GridIndex, Voxels>> in_box;
  for (const auto& [index, block] : map.entries()) {
    const Voxels voxels = voxelsIn(box, index, map.geometry());
    if (voxels.any() && holdsAnything(*block, voxels)) in_box.emplace_back(index, voxels);
  }
  std::sort(in_box.begin(), in_box.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<GridIndex> changed;
  for (const auto& [index, voxels] : in_box) {
    changed.push_back(index);
    if (!voxels.all()) {
      Block& block = map.getOrAllocate({index});
      clear(block, voxels);
      if (!block.empty()) continue;
    }
    map.erase({index});
  }
  return changed;
}

}  // namespace bki_mapping
