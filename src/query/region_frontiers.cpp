#include "query/region_frontiers.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace bki_mapping {
namespace {

/// The states around the blocks of a region.
class Neighbourhood {
 public:
  Neighbourhood(const StateMap& states, const GridIndex& region)
      : states_(states),
        region_(region),
        own_(states.region(region)),
        beside_{states.region({region.x - 1, region.y, region.z}),
                states.region({region.x + 1, region.y, region.z}),
                states.region({region.x, region.y - 1, region.z}),
                states.region({region.x, region.y + 1, region.z}),
                states.region({region.x, region.y, region.z - 1}),
                states.region({region.x, region.y, region.z + 1})} {}

  const BlockStates* own(const BlockIndex& block) const { return own_->find(states_, block); }
  /// @param block in the region, or beside it in the direction of `side`: 2 * axis, and 1 more if rising.
  const BlockStates* beside(const BlockIndex& block, std::size_t side) const {
    const StateMap::RegionStates* const in = SemanticMap::regionOf(block) == region_ ? own_ : beside_[side];
    return in ? in->find(states_, block) : nullptr;
  }

 private:
  const StateMap& states_;
  GridIndex region_;
  const StateMap::RegionStates* own_;
  std::array<const StateMap::RegionStates*, 6> beside_;
};

std::uint64_t unknownIn(const BlockStates* block, std::size_t z) {
  return block ? ~(block->layers[z].occupied | block->layers[z].free) : kAllOfLayer;
}

/// The frontier voxels of a block, found for 64 voxels at once by shifting its neighbours' bits to them.
BlockLayers frontierIn(const Neighbourhood& around, const BlockIndex& index) {
  BlockLayers layers{};
  const BlockStates* const block = around.own(index);
  if (!block->any_free) return layers;
  const BlockStates *const left = around.beside({{index.x - 1, index.y, index.z}}, 0),
                           *const right = around.beside({{index.x + 1, index.y, index.z}}, 1),
                           *const front = around.beside({{index.x, index.y - 1, index.z}}, 2),
                           *const back = around.beside({{index.x, index.y + 1, index.z}}, 3),
                           *const below = around.beside({{index.x, index.y, index.z - 1}}, 4),
                           *const above = around.beside({{index.x, index.y, index.z + 1}}, 5);
  constexpr int kToLastRow = kBlockEdge * kLastInBlock;
  constexpr auto kLast = static_cast<std::size_t>(kLastInBlock);
  for (std::size_t z = 0; z < kBlockEdge; ++z) {
    const std::uint64_t unknown = unknownIn(block, z);
    const std::uint64_t beside_x =
        (unknown << 1 & ~kFirstColumn) | (unknownIn(left, z) >> kLastInBlock & kFirstColumn) |
        (unknown >> 1 & ~kLastColumn) | (unknownIn(right, z) << kLastInBlock & kLastColumn);
    const std::uint64_t beside_y = unknown << kBlockEdge | unknownIn(front, z) >> kToLastRow |
                                   unknown >> kBlockEdge | unknownIn(back, z) << kToLastRow;
    const std::uint64_t beside_z = (z > 0 ? unknownIn(block, z - 1) : unknownIn(below, kLast)) |
                                   (z < kLast ? unknownIn(block, z + 1) : unknownIn(above, 0));
    layers[z] = block->layers[z].free & (beside_x | beside_y | beside_z);
  }
  return layers;
}

/// The number of bits in each byte.
std::uint64_t bitsOfBytes(std::uint64_t bits) {
  bits -= bits >> 1 & 0x5555555555555555u;
  bits = (bits & 0x3333333333333333u) + (bits >> 2 & 0x3333333333333333u);
  return (bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fu;
}
/// The sum of eight bytes.
std::int64_t sumOfBytes(std::uint64_t bytes) {
  const std::uint64_t pairs = (bytes & 0x00ff00ff00ff00ffu) + (bytes >> 8 & 0x00ff00ff00ff00ffu);
  return static_cast<std::int64_t>(pairs * 0x0001000100010001u >> 48);
}

VoxelSum sumOf(const BlockIndex& block, const BlockLayers& voxels) {
  // The bits of a layer whose x has the lowest, the middle and the highest binary digit.
  constexpr std::uint64_t kDigits[] = {0xaaaaaaaaaaaaaaaa, 0xcccccccccccccccc, 0xf0f0f0f0f0f0f0f0};
  std::uint64_t rows = 0;  // voxels by y, in a byte each: at most 64
  std::array<std::uint64_t, 3> with_digit{};
  std::array<std::uint64_t, kBlockEdge> of_layer;
  for (std::size_t z = 0; z < kBlockEdge; ++z) {
    of_layer[z] = bitsOfBytes(voxels[z]);
    rows += of_layer[z];
    for (std::size_t d = 0; d < 3; ++d) with_digit[d] += bitsOfBytes(voxels[z] & kDigits[d]);
  }
  std::int64_t count = 0, x = 0, y = 0, z_sum = 0;
  for (std::size_t z = 0; z < kBlockEdge; ++z) {
    const std::int64_t in_layer = sumOfBytes(of_layer[z]);
    count += in_layer;
    z_sum += static_cast<std::int64_t>(z) * in_layer;
    y += static_cast<std::int64_t>(z * (rows >> 8 * z & 0xff));  // here z counts rows
  }
  for (std::size_t d = 0; d < 3; ++d) x += sumOfBytes(with_digit[d]) << d;
  const VoxelIndex corner = GridGeometry::voxelOf(block, 0);
  VoxelSum sum;
  sum.count = static_cast<std::size_t>(count);
  sum.sum = {count * corner.x + x, count * corner.y + y, count * corner.z + z_sum};
  for (std::size_t z = 0; z < kBlockEdge; ++z) {
    if (voxels[z] == 0) continue;
    sum.first = GridGeometry::voxelOf(block, static_cast<int>(64 * z) + __builtin_ctzll(voxels[z]));
    break;
  }
  return sum;
}

}  // namespace

VoxelBox::VoxelBox(const GridGeometry& geometry, const Eigen::AlignedBox3d& box) {
  if (!box.min().allFinite() || !box.max().allFinite()) {
    throw std::invalid_argument("the box has a coordinate that is not finite; give finite ones");
  }
  if ((box.min().array() > box.max().array()).any()) {
    throw std::invalid_argument("the box is inside out; give a min below its max");
  }
  if (!geometry.contains(box.min()) || !geometry.contains(box.max())) {
    throw std::invalid_argument("the box reaches beyond the map's grid; cut it to where the map is");
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    ranges_[static_cast<std::size_t>(axis)] =
        overlapped(box.min()[axis] / geometry.resolution(), box.max()[axis] / geometry.resolution());
  }
}

std::uint64_t VoxelBox::bits(std::size_t axis, std::int32_t block) const {
  const std::int64_t first = std::int64_t{block} * kBlockEdge;
  const std::int64_t begin = std::max<std::int64_t>(0, ranges_[axis].begin - first),
                     end = std::min<std::int64_t>(kBlockEdge, ranges_[axis].end - first);
  return begin < end ? ((std::uint64_t{1} << end) - 1) & ~((std::uint64_t{1} << begin) - 1) : 0;
}

bool VoxelBox::overlapsRegion(const GridIndex& region) const {
  constexpr std::int64_t kEdge = Region::kEdge * kBlockEdge;  // [voxels]
  const auto overlaps_along = [&](std::size_t axis, std::int32_t index) {
    return ranges_[axis].begin < (index + 1) * kEdge && ranges_[axis].end > index * kEdge;
  };
  return overlaps_along(0, region.x) && overlaps_along(1, region.y) && overlaps_along(2, region.z);
}

bool VoxelBox::containsRegion(const GridIndex& region) const {
  constexpr std::int64_t kEdge = Region::kEdge * kBlockEdge;
  const auto contains_along = [&](std::size_t axis, std::int32_t index) {
    return ranges_[axis].begin <= index * kEdge && ranges_[axis].end >= (index + 1) * kEdge;
  };
  return contains_along(0, region.x) && contains_along(1, region.y) && contains_along(2, region.z);
}

void VoxelBox::cut(const BlockIndex& index, BlockLayers& layers) const {
  const std::uint64_t x = bits(0, index.x), y = bits(1, index.y), z = bits(2, index.z);
  std::uint64_t rows = 0;
  for (std::size_t row = 0; row < kBlockEdge; ++row) {
    if (y >> row & 1) rows |= x << kBlockEdge * row;
  }
  for (std::size_t layer = 0; layer < kBlockEdge; ++layer) layers[layer] &= z >> layer & 1 ? rows : 0;
}

void VoxelSum::add(const VoxelSum& other) {
  if (count == 0 || other.first < first) first = other.first;
  count += other.count;
  for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += other.sum[axis];
}

RegionFrontiers::RegionFrontiers(const StateMap& states, const Region& region, const VoxelBox* box) {
  const Neighbourhood around(states, region.index());
  if (!box) states.region(region.index())->readAll(states);
  for (int number = 0; number < Region::kBlocks; ++number) {
    begin_[static_cast<std::size_t>(number)] = static_cast<std::uint16_t>(pieces_.size());
    if (!region.has(number)) continue;
    const BlockIndex block = region.blockIndex(number);
    if (box && !box->overlaps(block)) continue;
    BlockLayers left = frontierIn(around, block);
    if (box) box->cut(block, left);
    for (std::size_t z = 0; z < kBlockEdge; ++z) {
      while (left[z] != 0) {
        BlockLayers seed{};
        seed[z] = left[z] & (~left[z] + 1);  // the lowest bit
        const BlockLayers grown = growInBlock(left, seed);
        for (std::size_t layer = z; layer < kBlockEdge; ++layer) left[layer] &= ~grown[layer];
        pieces_.push_back({block, 0, grown});
      }
    }
  }
  // A block has at most 64 pieces that do not touch.
  static_assert(Region::kBlocks * kBlockEdge * kBlockEdge <= std::numeric_limits<std::uint16_t>::max());
  begin_.back() = static_cast<std::uint16_t>(pieces_.size());
  joinPieces();
}

void RegionFrontiers::joinPieces() {
  Groups groups;
  for (std::size_t p = 0; p < pieces_.size(); ++p) groups.add();
  const GridIndex region = pieces_.empty() ? GridIndex() : SemanticMap::regionOf(pieces_.front().block);
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    const BlockIndex& block = pieces_[p].block;
    forEachNextBlock(pieces_[p].voxels, [&](int dx, int dy, int dz, const BlockLayers& there) {
      const BlockIndex next = {{block.x + dx, block.y + dy, block.z + dz}};
      if (SemanticMap::regionOf(next) != region) return;
      const auto number = static_cast<std::size_t>(Region::numberOf(next));
      for (std::uint32_t other = begin_[number]; other < begin_[number + 1]; ++other) {
        if (overlap(there, pieces_[other].voxels)) groups.join(p, other);
      }
    });
  }
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    const std::uint32_t root = groups.rootOf(p);  // the first of its group
    pieces_[p].part = root == p ? static_cast<std::uint32_t>(parts_.size()) : pieces_[root].part;
    if (root == p) parts_.emplace_back();
    parts_[pieces_[p].part].add(sumOf(pieces_[p].block, pieces_[p].voxels));
  }
}

}  // namespace bki_mapping
