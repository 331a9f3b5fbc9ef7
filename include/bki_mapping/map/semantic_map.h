/// @file The map: a sparse grid of blocks. (The state of a voxel: map_query.h.)
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/map/block.h"

namespace bki_mapping {

/// A sparse grid of Dirichlet posteriors. A voxel's concentrations are alpha[k] = prior + evidence[k] for
/// every class of the table and for `free`.
class SemanticMap {
 public:
  struct Entry {
    BlockIndex index;
    std::unique_ptr<Block> block;
    std::uint32_t position_in_region;  ///< in the region's list
  };

  /// @param prior concentration alpha0 of each class before any scan, > 0.
  /// @param class_count number of classes in the table, `free` not counted, 1 to 254.
  SemanticMap(const GridGeometry& geometry, double prior, std::size_t class_count)
      : geometry_(geometry), prior_(prior), class_count_(class_count) {
    free_gains_.fill(1.0f);
  }

  const GridGeometry& geometry() const { return geometry_; }
  double prior() const { return prior_; }
  std::size_t classCount() const { return class_count_; }
  /// Sum of a voxel's concentrations before any scan.
  double priorSum() const { return prior_ * static_cast<double>(class_count_ + 1); }

  /// Gain on the evidence for `free` when the state of a voxel is decided; 1 unless set. With a persistence
  /// P > 0, a gain above 1 decays towards 1 as 1 + (gain - 1) exp(-hits / P), so that an object that is hit
  /// scan after scan stays occupied even if its class can move (Equation 12 in docs/method.md).
  /// @param id of the class with the most evidence. @param hits the evidence for that class.
  float freeGain(ClassId id, float hits) const {
    const float gain = free_gains_[id];
    if (gain <= 1.0f || gain_persistence_ <= 0.0f) return gain;
    return 1.0f + (gain - 1.0f) * std::exp(-hits / gain_persistence_);
  }
  void setFreeGain(ClassId id, double gain) { free_gains_[id] = static_cast<float>(gain); }
  /// @param persistence in units of evidence; 0: gains do not decay.
  void setGainPersistence(double persistence) { gain_persistence_ = static_cast<float>(persistence); }

  /// All blocks, in unspecified order.
  const std::vector<Entry>& entries() const { return entries_; }
  std::size_t size() const { return entries_.size(); }

  /// @return nullptr if the map has no such block.
  const Block* find(const BlockIndex& index) const;
  /// The block with this index, which is created if missing.
  Block& getOrAllocate(const BlockIndex& index) { return *entries_[positionOf(index)].block; }
  /// The position of a block in entries(); the block is created if missing. The position is valid until a
  /// block is erased. @throws std::bad_alloc; the map is then unchanged.
  std::size_t positionOf(const BlockIndex& index);
  void erase(const BlockIndex& index) noexcept;
  /// Erases all blocks, and frees their memory and that of the index.
  void clear() noexcept;

  /// Edge of a region, a cube of blocks [blocks]. Blocks are also listed by region.
  static constexpr int kRegionEdge = 8;
  static GridIndex regionOf(const BlockIndex& block);

  /// Calls visit(index) for every block within `radius` of a point, and for some farther ones. The cost
  /// depends on the number of blocks near the point, not on the size of the map.
  /// @param point map frame [m]. @param radius [m].
  template <typename Visit>
  void forEachBlockNear(const Eigen::Vector3d& point, double radius, Visit&& visit) const {
    const double edge = kRegionEdge * geometry_.blockSize();
    const Eigen::Array3d low = ((point.array() - radius) / edge).floor();
    const Eigen::Array3d high = ((point.array() + radius) / edge).floor();
    if (!((high - low + 1.0).prod() < static_cast<double>(regions_.size()))) {
      for (const Entry& entry : entries_) visit(entry.index);
      return;
    }
    const Eigen::Array3i first = low.cast<int>(), last = high.cast<int>();
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int x = first.x(); x <= last.x(); ++x) {
          const std::uint32_t region = region_position_.find({x, y, z});
          if (region == kNoPosition) continue;
          for (const std::uint32_t entry : regions_[region].entries) visit(entries_[entry].index);
        }
      }
    }
  }

  /// Adds the evidence of another map, so that this one holds the posterior of both sets of scans.
  /// @throws std::invalid_argument if the resolution, the prior or the number of classes differs.
  void add(const SemanticMap& other);

  /// Allocated memory of all blocks and of the index [bytes].
  std::size_t bytes() const;
  /// The part of bytes() that does not belong to the blocks in entries(). Linear in the number of regions.
  std::size_t indexBytes() const;

 private:
  struct Region {
    GridIndex index;
    std::vector<std::uint32_t> entries;  ///< its blocks, by position in entries_
  };

  /// Adds a block that the map does not have. @throws std::bad_alloc; the map is then unchanged.
  void append(const BlockIndex& index);
  /// The list of the blocks in the region of a block; the region is created if missing.
  std::vector<std::uint32_t>& regionAt(const BlockIndex& block);
  /// Erases the region of a block if it is empty.
  void dropIfEmpty(const BlockIndex& block) noexcept;

  GridGeometry geometry_;
  double prior_;
  std::size_t class_count_;
  std::array<float, 256> free_gains_;
  float gain_persistence_ = 0.0f;
  std::vector<Entry> entries_;
  GridTable position_;  ///< of each block in entries_
  std::vector<Region> regions_;
  GridTable region_position_;  ///< of each region in regions_
  // The capacity of both suffices for all present blocks and regions, so that erasing allocates nothing:
  std::vector<std::unique_ptr<Block>> spare_;            ///< empty blocks, to be reused
  std::vector<std::vector<std::uint32_t>> spare_lists_;  ///< lists of erased regions, to be reused
  std::size_t spare_bytes_ = 0;                          ///< memory of the blocks in spare_
};

}  // namespace bki_mapping
