#include "bki_mapping/query/frontiers.h"

#include <algorithm>
#include <utility>

namespace bki_mapping {
namespace {

constexpr std::size_t kBlocksPerJob = 256;
constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr std::uint64_t kFirstColumn = kAll / 0xff;  ///< the voxels with x = 0 of a layer

/// A set of voxels of a block, by layer.
using Layers = std::array<std::uint64_t, kBlockEdge>;

class FrontierFinder {
 public:
  explicit FrontierFinder(const StateMap& states) : states_(states), blocks_(sortedBlocks(states.map())) {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      position_.insert(blocks_[b].first, static_cast<std::uint32_t>(b));
    }
    left_.resize(blocks_.size());
    cluster_.resize(blocks_.size());
    reached_.resize(blocks_.size());
    states.parallelFor((blocks_.size() + kBlocksPerJob - 1) / kBlocksPerJob, [&](std::size_t job) {
      BlockReader reader(states);
      const std::size_t end = std::min(blocks_.size(), (job + 1) * kBlocksPerJob);
      for (std::size_t b = job * kBlocksPerJob; b < end; ++b) left_[b] = frontierIn(reader, blocks_[b].first);
    });
  }

  std::vector<Frontier> clusters(std::size_t min_size) {
    std::vector<Frontier> found;
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        while (left_[b][z] != 0) {
          Layers seed{};
          seed[z] = left_[b][z] & (~left_[b][z] + 1);  // the lowest bit
          const std::size_t size = takeCluster(b, seed);
          if (size >= min_size) found.push_back(makeFrontier(size));
          for (const std::uint32_t part : parts_) cluster_[part] = {};
        }
      }
    }
    std::sort(found.begin(), found.end(), [](const Frontier& a, const Frontier& b) {
      if (a.voxels.size() != b.voxels.size()) return a.voxels.size() > b.voxels.size();
      return a.voxels.front() < b.voxels.front();
    });
    return found;
  }

 private:
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
      spread(blocks_[b].first, grown);
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

  /// The voxels in cluster_, in the order of GridIndex.
  Frontier makeFrontier(std::size_t size) {
    std::sort(parts_.begin(), parts_.end());  // blocks_ is sorted, too
    Frontier frontier;
    frontier.centre.setZero();
    frontier.voxels.reserve(size);
    const auto differs = [this](std::size_t n, auto coordinate) {
      return n == parts_.size() ||
             blocks_[parts_[n]].first.*coordinate != blocks_[parts_[n - 1]].first.*coordinate;
    };
    for (std::size_t slab = 0, next_slab = 0; slab < parts_.size(); slab = next_slab) {
      while (!differs(++next_slab, &BlockIndex::z)) {
      }
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        for (std::size_t row = slab, next_row = slab; row < next_slab; row = next_row) {
          while (++next_row < next_slab && !differs(next_row, &BlockIndex::y)) {
          }
          for (std::size_t y = 0; y < kBlockEdge; ++y) {
            for (std::size_t n = row; n < next_row; ++n) appendRow(parts_[n], y, z, frontier);
          }
        }
      }
    }
    frontier.centre /= static_cast<double>(size);
    return frontier;
  }

  void appendRow(std::uint32_t b, std::size_t y, std::size_t z, Frontier& frontier) const {
    for (std::uint64_t row = cluster_[b][z] >> kBlockEdge * y & 0xff; row != 0; row &= row - 1) {
      const auto offset = static_cast<int>(64 * z + kBlockEdge * y) + __builtin_ctzll(row);
      const VoxelIndex voxel = GridGeometry::voxelOf(blocks_[b].first, offset);
      frontier.voxels.push_back(voxel);
      frontier.centre += states_.geometry().voxelCentre(voxel);
    }
  }

  const StateMap& states_;
  std::vector<std::pair<BlockIndex, const Block*>> blocks_;
  GridTable position_;  ///< of each block in blocks_
  // Of each block:
  std::vector<Layers> left_;     ///< frontier voxels that no cluster has taken
  std::vector<Layers> cluster_;  ///< voxels of the present cluster
  std::vector<Layers> reached_;  ///< voxels that belong to it, and whose neighbours are still to be found
  // Positions in blocks_:
  std::vector<std::uint32_t> parts_;    ///< of blocks in which cluster_ has voxels
  std::vector<std::uint32_t> to_grow_;  ///< of blocks in which reached_ has voxels
};

}  // namespace

std::vector<Frontier> frontiers(const StateMap& states, std::size_t min_size) {
  return FrontierFinder(states).clusters(min_size);
}

}  // namespace bki_mapping
