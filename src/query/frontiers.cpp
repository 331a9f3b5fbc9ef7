#include "bki_mapping/query/frontiers.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "query/voxel_rows.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kBlocksPerJob = 256;
constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr std::uint64_t kFirstColumn = kAll / 0xff;  ///< the voxels with x = 0 of a layer

/// A set of voxels of a block, by layer.
using Layers = std::array<std::uint64_t, kBlockEdge>;

/// The voxels that a box overlaps.
class VoxelBox {
 public:
  /// @throws std::invalid_argument.
  VoxelBox(const GridGeometry& geometry, const Eigen::AlignedBox3d& box) {
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

  bool overlaps(const BlockIndex& index) const {
    return bits(0, index.x) != 0 && bits(1, index.y) != 0 && bits(2, index.z) != 0;
  }
  /// Takes the voxels outside the box out of a block's.
  void cut(const BlockIndex& index, Layers& layers) const {
    const std::uint64_t x = bits(0, index.x), y = bits(1, index.y), z = bits(2, index.z);
    std::uint64_t rows = 0;
    for (std::size_t row = 0; row < kBlockEdge; ++row) {
      if (y >> row & 1) rows |= x << kBlockEdge * row;
    }
    for (std::size_t layer = 0; layer < kBlockEdge; ++layer) layers[layer] &= z >> layer & 1 ? rows : 0;
  }

 private:
  /// Those of a block's eight layers across an axis that are in the box. @param block its index on the axis.
  std::uint64_t bits(std::size_t axis, std::int32_t block) const {
    const std::int64_t first = std::int64_t{block} * kBlockEdge;
    const std::int64_t begin = std::max<std::int64_t>(0, ranges_[axis].begin - first),
                       end = std::min<std::int64_t>(kBlockEdge, ranges_[axis].end - first);
    return begin < end ? ((std::uint64_t{1} << end) - 1) & ~((std::uint64_t{1} << begin) - 1) : 0;
  }

  std::array<VoxelRange, 3> ranges_;
};

class FrontierFinder {
 public:
  FrontierFinder(const StateMap& states, const FrontierRules& rules)
      : states_(states), with_voxels_(rules.with_voxels), min_size_(rules.min_size) {
    std::optional<VoxelBox> box;
    if (rules.box) box.emplace(states.geometry(), *rules.box);
    for (const auto& entry : states.map().entries()) {
      if (!box || box->overlaps(entry.index)) blocks_.push_back(entry.index);
    }
    std::sort(blocks_.begin(), blocks_.end());
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      position_.insert(blocks_[b], static_cast<std::uint32_t>(b));
    }
    left_.resize(blocks_.size());
    cluster_.resize(blocks_.size());
    reached_.resize(blocks_.size());
    states.parallelFor((blocks_.size() + kBlocksPerJob - 1) / kBlocksPerJob, [&](std::size_t job) {
      BlockReader reader(states);
      const std::size_t end = std::min(blocks_.size(), (job + 1) * kBlocksPerJob);
      for (std::size_t b = job * kBlocksPerJob; b < end; ++b) {
        left_[b] = frontierIn(reader, blocks_[b]);
        if (box) box->cut(blocks_[b], left_[b]);
      }
    });
  }

  std::vector<Frontier> clusters() {
    std::vector<Found> found;
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        while (left_[b][z] != 0) {
          Layers seed{};
          seed[z] = left_[b][z] & (~left_[b][z] + 1);  // the lowest bit
          const std::size_t size = takeCluster(b, seed);
          if (size >= min_size_) found.push_back(makeFrontier(size));
          for (const std::uint32_t part : parts_) cluster_[part] = {};
        }
      }
    }
    std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
      if (a.frontier.size != b.frontier.size) return a.frontier.size > b.frontier.size;
      return a.first < b.first;
    });
    std::vector<Frontier> frontiers;
    frontiers.reserve(found.size());
    for (Found& each : found) frontiers.push_back(std::move(each.frontier));
    return frontiers;
  }

 private:
  struct Found {
    Frontier frontier;
    VoxelIndex first;  ///< of its voxels, in the order of GridIndex
  };

  static std::uint64_t unknownIn(const BlockStates* block, std::size_t z) {
    return block ? ~(block->layers[z].occupied | block->layers[z].free) : kAll;
  }

  /// The frontier voxels of a block, found for 64 voxels at once by shifting its neighbours' bits to them.
  static Layers frontierIn(BlockReader& reader, const BlockIndex& index) {
    Layers layers{};
    const BlockStates* const block = reader.find(index);
    if (!block->any_free) return layers;
    const auto neighbour = [&](int x, int y, int z) {
      return reader.find({{index.x + x, index.y + y, index.z + z}});
    };
    const BlockStates *const left = neighbour(-1, 0, 0), *const right = neighbour(1, 0, 0),
                             *const front = neighbour(0, -1, 0), *const back = neighbour(0, 1, 0),
                             *const below = neighbour(0, 0, -1), *const above = neighbour(0, 0, 1);
    constexpr int kLast = kBlockEdge - 1, kLastRow = kBlockEdge * kLast;
    for (std::size_t z = 0; z < kBlockEdge; ++z) {
      const std::uint64_t unknown = unknownIn(block, z);
      const std::uint64_t beside_x =
          (unknown << 1 & ~kFirstColumn) | (unknownIn(left, z) >> kLast & kFirstColumn) |
          (unknown >> 1 & ~(kFirstColumn << kLast)) | (unknownIn(right, z) << kLast & kFirstColumn << kLast);
      const std::uint64_t beside_y = unknown << kBlockEdge | unknownIn(front, z) >> kLastRow |
                                     unknown >> kBlockEdge | unknownIn(back, z) << kLastRow;
      const std::uint64_t beside_z = (z > 0 ? unknownIn(block, z - 1) : unknownIn(below, kLast)) |
                                     (z < kLast ? unknownIn(block, z + 1) : unknownIn(above, 0));
      layers[z] = block->layers[z].free & (beside_x | beside_y | beside_z);
    }
    return layers;
  }

  /// Moves all voxels that are connected with a seed from left_ to cluster_, a block at a time: what is
  /// reached in a block is grown there, and then spreads to the blocks around it.
  /// @return the number of voxels.
  std::size_t takeCluster(std::uint32_t first, const Layers& seed) {
    std::size_t size = 0;
    parts_.clear();
    reach(first, seed);
    while (!to_grow_.empty()) {
      const std::uint32_t b = to_grow_.back();
      to_grow_.pop_back();
      const Layers grown = growIn(left_[b], std::exchange(reached_[b], {}));
      if (empty(cluster_[b])) parts_.push_back(b);
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        size += static_cast<std::size_t>(__builtin_popcountll(grown[z]));
        left_[b][z] &= ~grown[z];
        cluster_[b][z] |= grown[z];
      }
      spread(blocks_[b], grown);
    }
    return size;
  }

  /// Notes that voxels of a block, as far as they are left, belong to the cluster.
  void reach(std::uint32_t b, const Layers& voxels) {
    const bool waits = !empty(reached_[b]);
    for (std::size_t z = 0; z < kBlockEdge; ++z) reached_[b][z] |= voxels[z] & left_[b][z];
    if (!waits && !empty(reached_[b])) to_grow_.push_back(b);
  }

  /// Reaches the neighbours of voxels in the blocks around theirs.
  void spread(const BlockIndex& index, const Layers& voxels) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        Layers beside;
        for (std::size_t z = 0; z < kBlockEdge; ++z) beside[z] = besideY(besideX(voxels[z], dx), dy);
        if (empty(beside)) continue;
        for (int dz = -1; dz <= 1; ++dz) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          const Layers there = besideZ(beside, dz);
          if (empty(there)) continue;
          const std::uint32_t b = position_.find({index.x + dx, index.y + dy, index.z + dz});
          if (b != kNoPosition) reach(b, there);
        }
      }
    }
  }

  /// What of `within` is connected with `seed` inside the block.
  static Layers growIn(const Layers& within, Layers seed) {
    for (bool grows = true; grows;) {
      Layers beside;
      for (std::size_t z = 0; z < kBlockEdge; ++z) beside[z] = besideY(besideX(seed[z], 0), 0);
      beside = besideZ(beside, 0);
      grows = false;
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        const std::uint64_t grown = beside[z] & within[z];
        grows = grows || grown != seed[z];
        seed[z] = grown;
      }
    }
    return seed;
  }

  // Voxels and those beside them along an axis: what of these lies in the same block (step 0), or in the next
  // one in either direction (step 1 or -1).
  static std::uint64_t besideX(std::uint64_t layer, int step) {
    constexpr int kLast = kBlockEdge - 1;
    constexpr std::uint64_t kLastColumn = kFirstColumn << kLast;
    if (step > 0) return layer >> kLast & kFirstColumn;
    if (step < 0) return layer << kLast & kLastColumn;
    return layer | (layer << 1 & ~kFirstColumn) | (layer >> 1 & ~kLastColumn);
  }
  static std::uint64_t besideY(std::uint64_t layer, int step) {
    constexpr int kLastRow = kBlockEdge * (kBlockEdge - 1);
    if (step > 0) return layer >> kLastRow;
    if (step < 0) return layer << kLastRow;
    return layer | layer << kBlockEdge | layer >> kBlockEdge;
  }
  static Layers besideZ(const Layers& layers, int step) {
    constexpr std::size_t kLast = kBlockEdge - 1;
    Layers beside{};
    if (step > 0) {
      beside[0] = layers[kLast];
    } else if (step < 0) {
      beside[kLast] = layers[0];
    } else {
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        beside[z] = layers[z] | (z > 0 ? layers[z - 1] : 0) | (z < kLast ? layers[z + 1] : 0);
      }
    }
    return beside;
  }

  static bool empty(const Layers& layers) {
    std::uint64_t any = 0;
    for (const std::uint64_t layer : layers) any |= layer;
    return any == 0;
  }

  /// The voxels in cluster_.
  Found makeFrontier(std::size_t size) {
    Found found;
    found.frontier.size = size;
    // The sum of indices, which is exact in any order.
    std::array<std::int64_t, 3> sum{};
    std::optional<VoxelIndex> first;
    for (const std::uint32_t b : parts_) {
      const VoxelIndex corner = GridGeometry::voxelOf(blocks_[b], 0);
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        const std::uint64_t layer = cluster_[b][z];
        if (layer == 0) continue;
        const std::int64_t count = __builtin_popcountll(layer);
        sum[0] += count * corner.x + sumOfDigits(layer, kDigitsX);
        sum[1] += count * corner.y + sumOfDigits(layer, kDigitsY);
        sum[2] += count * (corner.z + static_cast<std::int32_t>(z));
        const VoxelIndex lowest =
            GridGeometry::voxelOf(blocks_[b], static_cast<int>(64 * z) + __builtin_ctzll(layer));
        if (!first || lowest < *first) first = lowest;
      }
    }
    found.first = *first;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const auto total = static_cast<double>(sum[static_cast<std::size_t>(axis)]);
      found.frontier.centre[axis] =
          (total / static_cast<double>(size) + 0.5) * states_.geometry().resolution();
    }
    if (with_voxels_) found.frontier.voxels = voxelsOfCluster(size);
    return found;
  }

  // The bits of a layer whose x or y has the lowest, the middle and the highest binary digit.
  static constexpr std::array<std::uint64_t, 3> kDigitsX = {0xaaaaaaaaaaaaaaaa, 0xcccccccccccccccc,
                                                            0xf0f0f0f0f0f0f0f0},
                                                kDigitsY = {0xff00ff00ff00ff00, 0xffff0000ffff0000,
                                                            0xffffffff00000000};
  /// The sum of the x or y of a layer's voxels within their block.
  static std::int64_t sumOfDigits(std::uint64_t layer, const std::array<std::uint64_t, 3>& digits) {
    return __builtin_popcountll(layer & digits[0]) + 2 * __builtin_popcountll(layer & digits[1]) +
           4 * __builtin_popcountll(layer & digits[2]);
  }

  /// The voxels in cluster_, in the order of GridIndex.
  std::vector<VoxelIndex> voxelsOfCluster(std::size_t size) {
    std::sort(parts_.begin(), parts_.end());  // blocks_ is sorted, too
    std::vector<VoxelIndex> voxels;
    voxels.reserve(size);
    const auto differs = [this](std::size_t n, auto coordinate) {
      return n == parts_.size() || blocks_[parts_[n]].*coordinate != blocks_[parts_[n - 1]].*coordinate;
    };
    for (std::size_t slab = 0, next_slab = 0; slab < parts_.size(); slab = next_slab) {
      while (!differs(++next_slab, &BlockIndex::z)) {
      }
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        for (std::size_t row = slab, next_row = slab; row < next_slab; row = next_row) {
          while (++next_row < next_slab && !differs(next_row, &BlockIndex::y)) {
          }
          for (std::size_t y = 0; y < kBlockEdge; ++y) {
            for (std::size_t n = row; n < next_row; ++n) appendRow(parts_[n], y, z, voxels);
          }
        }
      }
    }
    return voxels;
  }

  void appendRow(std::uint32_t b, std::size_t y, std::size_t z, std::vector<VoxelIndex>& voxels) const {
    for (std::uint64_t row = cluster_[b][z] >> kBlockEdge * y & 0xff; row != 0; row &= row - 1) {
      const auto offset = static_cast<int>(64 * z + kBlockEdge * y) + __builtin_ctzll(row);
      voxels.push_back(GridGeometry::voxelOf(blocks_[b], offset));
    }
  }

  const StateMap& states_;
  bool with_voxels_;
  std::size_t min_size_;
  std::vector<BlockIndex> blocks_;  ///< that overlap the box
  GridTable position_;              ///< of each block in blocks_
  // Of each block:
  std::vector<Layers> left_;     ///< frontier voxels that no cluster has taken
  std::vector<Layers> cluster_;  ///< voxels of the present cluster
  std::vector<Layers> reached_;  ///< voxels that belong to it, and whose neighbours are still to be found
  // Positions in blocks_:
  std::vector<std::uint32_t> parts_;    ///< of blocks in which cluster_ has voxels
  std::vector<std::uint32_t> to_grow_;  ///< of blocks in which reached_ has voxels
};

}  // namespace

std::vector<Frontier> frontiers(const StateMap& states, const FrontierRules& rules) {
  return FrontierFinder(states, rules).clusters();
}

std::vector<Frontier> frontiers(const StateMap& states, std::size_t min_size) {
  return frontiers(states, FrontierRules{min_size, true, std::nullopt});
}

}  // namespace bki_mapping
