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
    states.parallelFor((blocks_.size() + kBlocksPerJob - 1) / kBlocksPerJob, [&](std::size_t job) {
      BlockReader reader(states);
      const std::size_t end = std::min(blocks_.size(), (job + 1) * kBlocksPerJob);
      for (std::size_t b = job * kBlocksPerJob; b < end; ++b) left_[b] = frontierIn(reader, blocks_[b].first);
    });
  }

  std::vector<Frontier> clusters(std::size_t min_size) {
    std::vector<Frontier> found;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        while (left_[b][z] != 0) {
          const auto offset = static_cast<int>(64 * z) + __builtin_ctzll(left_[b][z]);
          Frontier frontier = takeCluster(GridGeometry::voxelOf(blocks_[b].first, offset));
          if (frontier.voxels.size() >= min_size) found.push_back(std::move(frontier));
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

  /// Takes a voxel from those left. @return whether it was there.
  bool take(const VoxelIndex& voxel) {
    const BlockIndex index = GridGeometry::blockOf(voxel);
    if (index != last_index_ || last_ == kNoPosition) {
      last_index_ = index;
      last_ = position_.find(index);
      if (last_ == kNoPosition) return false;
    }
    const auto offset = static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel));
    std::uint64_t& layer = left_[last_][offset / 64];
    const std::uint64_t bit = std::uint64_t{1} << offset % 64;
    const bool was_there = (layer & bit) != 0;
    layer &= ~bit;
    return was_there;
  }

  Frontier takeCluster(const VoxelIndex& seed) {
    Frontier frontier;
    std::vector<VoxelIndex>& voxels = frontier.voxels;  // those whose neighbours are still to be taken, too
    take(seed);
    voxels.push_back(seed);
    for (std::size_t n = 0; n < voxels.size(); ++n) {
      const VoxelIndex from = voxels[n];
      for (int dz = -1; dz <= 1; ++dz) {
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            const VoxelIndex to = {{from.x + dx, from.y + dy, from.z + dz}};
            if (take(to)) voxels.push_back(to);
          }
        }
      }
    }
    std::sort(voxels.begin(), voxels.end());
    frontier.centre.setZero();
    for (const VoxelIndex& voxel : voxels) frontier.centre += states_.geometry().voxelCentre(voxel);
    frontier.centre /= static_cast<double>(voxels.size());
    return frontier;
  }

  const StateMap& states_;
  std::vector<std::pair<BlockIndex, const Block*>> blocks_;
  GridTable position_;        ///< of each block in blocks_
  std::vector<Layers> left_;  ///< frontier voxels of each block that no cluster has taken
  BlockIndex last_index_;     ///< that take() saw last
  std::uint32_t last_ = kNoPosition;
};

}  // namespace

std::vector<Frontier> frontiers(const StateMap& states, std::size_t min_size) {
  return FrontierFinder(states).clusters(min_size);
}

}  // namespace bki_mapping
