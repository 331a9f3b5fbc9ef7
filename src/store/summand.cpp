#include "store/summand.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cstring>
#include <map>

namespace bki_mapping {
namespace {

/// Subtracts the evidence, marks and looks of a map from a sum that contains them.
/// @return false if that is impossible because the sum is saturated.
bool subtract(SemanticMap& sum, const SemanticMap& other) {
  bool possible = true;
  for (const auto& [index, block] : other.entries()) {
    Block& from = sum.getOrAllocate(index);
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      const EvidenceUnits* const units = block->plane(p);
      from.change(block->classes()[p], [&](EvidenceUnits* plane) {
        for (int v = 0; v < kBlockVoxels; ++v) {
          if (units[v] == 0) continue;
          possible = possible && plane[v] < kMostUnits && plane[v] > -kMostUnits;
          const std::int64_t difference = std::int64_t{plane[v]} - units[v], most = kMostUnits;
          plane[v] = static_cast<EvidenceUnits>(std::clamp(difference, -most, most));
        }
        return false;
      });
    }
    from.setOcclusion(from.occlusion() & ~block->occlusion());
    from.looks().subtract(block->looks());
    if (from.empty()) sum.erase(index);
  }
  return possible;
}

/// A voxel of the source. @param block nullptr if the source has none there.
struct SourceVoxel {
  const Block* block;
  int offset;
};
using SourceVoxels = std::array<SourceVoxel, kBlockVoxels>;

void gatherLooks(const SourceVoxels& voxels, Looks& looks) {
  std::vector<const Block*> blocks;
  for (const SourceVoxel& voxel : voxels) {
    const bool known = std::find(blocks.begin(), blocks.end(), voxel.block) != blocks.end();
    if (voxel.block && !known && !voxel.block->looks().empty()) blocks.push_back(voxel.block);
  }
  for (const Block* const block : blocks) {
    Looks moved = block->looks();
    moved.moveVoxels([&](Look::Voxels& mask) {
      Look::Voxels there;
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        there[v] = voxels[v].block == block && mask[static_cast<std::size_t>(voxels[v].offset)];
      }
      mask = there;
    });
    looks.add(moved);
  }
}

/// Whether the source has a block from which a voxel of a block of the target may come.
bool hasSourceOf(const SemanticMap& source, const GridTransform& transform, const BlockIndex& index) {
  GridIndex low = transform.sourceOf(GridGeometry::voxelOf(index, 0)), high = low;
  for (const int x : {0, kBlockEdge - 1}) {
    for (const int y : {0, kBlockEdge - 1}) {
      for (const int z : {0, kBlockEdge - 1}) {
        const GridIndex corner = transform.sourceOf(
            {{index.x * kBlockEdge + x, index.y * kBlockEdge + y, index.z * kBlockEdge + z}});
        low = {std::min(low.x, corner.x), std::min(low.y, corner.y), std::min(low.z, corner.z)};
        high = {std::max(high.x, corner.x), std::max(high.y, corner.y), std::max(high.z, corner.z)};
      }
    }
  }
  // The others lie between these, but for rounding.
  const BlockIndex first = GridGeometry::blockOf({{low.x - 1, low.y - 1, low.z - 1}}),
                   last = GridGeometry::blockOf({{high.x + 1, high.y + 1, high.z + 1}});
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        if (source.find({{x, y, z}})) return true;
      }
    }
  }
  return false;
}

/// A block of the target, whose voxels come from several blocks of the source.
void gatherBlock(const SemanticMap& source, const GridTransform& transform, const BlockIndex& index,
                 SemanticMap& target) {
  if (!hasSourceOf(source, transform, index)) return;
  SourceVoxels voxels;
  std::bitset<256> classes;
  Block::Occlusion marks;
  BlockIndex last_index{};
  const Block* last = source.find(last_index);
  bool any = false;
  // Turns are about z, so x and y are those of the first layer, and z is that of the first voxel of a layer.
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  std::array<VoxelIndex, kLayer> first_layer;
  for (int v = 0; v < kLayer; ++v) {
    first_layer[static_cast<std::size_t>(v)] = transform.sourceOf(GridGeometry::voxelOf(index, v));
  }
  int z = 0;
  for (int v = 0; v < kBlockVoxels; ++v) {
    VoxelIndex from = first_layer[static_cast<std::size_t>(v % kLayer)];
    if (v % kLayer == 0) z = transform.sourceOf(GridGeometry::voxelOf(index, v)).z;
    from.z = z;
    const BlockIndex block = GridGeometry::blockOf(from);
    if (block != last_index) {
      last_index = block;
      last = source.find(block);
    }
    const int offset = GridGeometry::offsetInBlock(from);
    voxels[static_cast<std::size_t>(v)] = {last, offset};
    if (!last) continue;
    any = true;
    for (const ClassId id : last->classes()) classes[id] = true;
    marks[static_cast<std::size_t>(v)] = last->occlusion()[static_cast<std::size_t>(offset)];
  }
  if (!any) return;
  Block& block = target.getOrAllocate(index);
  std::array<EvidenceUnits, kBlockVoxels> plane;
  for (std::size_t id = 0; id < classes.size(); ++id) {
    if (!classes[id]) continue;
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      const EvidenceUnits* const units =
          voxels[v].block ? voxels[v].block->evidence(static_cast<ClassId>(id)) : nullptr;
      plane[v] = units ? units[voxels[v].offset] : 0;
    }
    block.add(static_cast<ClassId>(id), plane.data());
  }
  block.setOcclusion(marks);
  gatherLooks(voxels, block.looks());
  if (block.empty()) target.erase(index);
}

template <typename Visit>
void forEachTile(const TileRange& range, Visit&& visit) {
  for (int z = range.low.z; z <= range.high.z; ++z) {
    for (int y = range.low.y; y <= range.high.y; ++y) {
      for (int x = range.low.x; x <= range.high.x; ++x) visit(GridIndex{x, y, z});
    }
  }
}

}  // namespace

std::vector<GridIndex> Summand::tiles() const {
  std::vector<GridIndex> tiles;
  for (const TileEntry& entry : source_->file.tiles(part_)) {
    if (source_->transform.identity()) {
      tiles.push_back(entry.index);
    } else {
      forEachTile(source_->transform.targetTiles(entry.index),
                  [&](const GridIndex& tile) { tiles.push_back(tile); });
    }
  }
  std::sort(tiles.begin(), tiles.end());
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  return tiles;
}

void Summand::addStored(SemanticMap& map, const GridIndex& tile) const {
  MapFile& file = source_->file;
  if (!file.addTileTo(map, {tile, part_})) return;
  for (const int part : without_) {
    SemanticMap other = file.info().emptyMap();
    if (!file.addTileTo(other, {tile, part}) || subtract(map, other)) continue;
    throw MapFileError(
        "evidence in " + path() +
        " has reached its greatest value, 32,768, so that its drives can no longer be separated; keep all "
        "drives of this map, and leave them out of the other maps (--without)");
  }
}

SemanticMap Summand::read(const GridIndex& tile) const {
  SemanticMap evidence = source_->file.info().emptyMap();
  const GridTransform& transform = source_->transform;
  if (transform.identity()) {
    addStored(evidence, tile);
    return evidence;
  }
  SemanticMap stored = source_->file.info().emptyMap();
  forEachTile(transform.sourceTiles(tile), [&](const GridIndex& source) { addStored(stored, source); });
  if (stored.size() == 0) return evidence;
  const Region region(tile);
  for (int number = 0; number < Region::kBlocks; ++number) {
    gatherBlock(stored, transform, region.blockIndex(number), evidence);
  }
  return evidence;
}

std::vector<Summand> summandsOf(const std::shared_ptr<PlacedFile>& source) {
  std::map<int, std::set<std::string>> by_part;
  std::set<std::string> all;
  for (const DriveRecord& drive : source->file.drives()) {
    by_part[drive.part].insert(drive.id);
    all.insert(drive.id);
  }
  std::vector<Summand> summands;
  if (all.empty()) {
    if (source->file.tiles().empty()) return summands;
    throw MapFileError(
        source->file.path() +
        " does not say which drives it contains, so that a drive could count twice; map the drives again "
        "with a program that names them");
  }
  std::set<int> parts;
  for (const auto& [part, drives] : by_part) {
    if (part > 0) parts.insert(part);
  }
  for (const auto& [part, drives] : by_part) {
    if (drives == all) continue;  // the sum, below
    summands.emplace_back(source, drives, part, part == 0 ? parts : std::set<int>());
  }
  summands.emplace_back(source, all, 0);
  return summands;
}

bool sameEvidence(const SemanticMap& a, const SemanticMap& b) {
  if (a.size() != b.size()) return false;
  for (const auto& [index, block] : a.entries()) {
    const Block* const other = b.find(index);
    if (!other || other->classes() != block->classes() || other->occlusion() != block->occlusion()) {
      return false;
    }
    const std::size_t units = block->classes().size() * kBlockVoxels;
    if (!std::equal(block->plane(0), block->plane(0) + units, other->plane(0))) return false;
  }
  return true;
}

}  // namespace bki_mapping
