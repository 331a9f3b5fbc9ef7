/// @file The map: a sparse grid of blocks, shared with its snapshots and copied when written. It holds
/// evidence and decides nothing. (The state of a voxel: rules/voxel_state.h.) clearBox() erases a part of it.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/map/block.h"
#include "bki_mapping/map/region.h"

namespace bki_mapping {

/// A sparse grid of Dirichlet posteriors. A voxel's concentrations are alpha[k] = prior + evidence[k] for
/// every class of the table and for `free`. A map and its snapshots share regions and blocks: the map copies
/// a region or a block before it writes to it for the first time after a snapshot.
class SemanticMap {
 public:
  struct Entry {
    BlockIndex index;
    const Block* block;
  };
  class Entries;

  /// @param prior concentration alpha0 of each class before any scan, > 0.
  /// @param class_count number of classes in the table, `free` not counted, 1 to 254.
  SemanticMap(const GridGeometry& geometry, double prior, std::size_t class_count)
      : geometry_(geometry), prior_(prior), class_count_(class_count) {}
  // Copies would not know that they share blocks: snapshot() makes one.
  SemanticMap(const SemanticMap&) = delete;
  SemanticMap& operator=(const SemanticMap&) = delete;
  SemanticMap(SemanticMap&&) = default;
  SemanticMap& operator=(SemanticMap&&) = default;

  const GridGeometry& geometry() const { return geometry_; }
  double prior() const { return prior_; }
  std::size_t classCount() const { return class_count_; }
  /// Sum of a voxel's concentrations before any scan.
  double priorSum() const { return prior_ * static_cast<double>(class_count_ + 1); }

  /// All blocks, in unspecified order: a range for `for (const auto& [index, block] : map.entries())`.
  Entries entries() const;
  std::size_t size() const { return size_; }

  /// A copy of the map as it is now; later changes of this map do not affect it. Its time and memory grow
  /// with the number of regions, not of blocks; this map copies a block when it next writes to it (copy on
  /// write; src/update/map_updater.cpp does so for scans). Other threads may read and destroy snapshots while
  /// this map is written to.
  SemanticMap snapshot();

  /// @return nullptr if the map has no such block.
  const Block* find(const BlockIndex& index) const;
  /// The block with this index, to be written to. It is created if missing, and copied if it is shared.
  /// @throws std::bad_alloc; the map is then unchanged.
  Block& getOrAllocate(const BlockIndex& index);

  /// A block that is going to be written to.
  struct Claim {
    Block* block;
    bool is_new;
    bool shared;  ///< with a snapshot: write to a copy, and replace the block by the copy
  };
  /// As getOrAllocate(), but leaves it to the caller to copy a shared block, so that many can be copied at
  /// once. After this, replace() allocates nothing, until the next snapshot.
  Claim claim(const BlockIndex& index);
  /// Replaces a claimed block.
  void replace(const BlockIndex& index, std::shared_ptr<Block> block) noexcept;

  /// Erases a block if the map has it. Allocates nothing after a claim() of the block.
  /// @throws std::bad_alloc; the map is then unchanged.
  void erase(const BlockIndex& index);
  /// Erases all blocks, and frees their memory and that of the index.
  void clear() noexcept;

  static GridIndex regionOf(const BlockIndex& block) { return Region::regionOf(block); }
  /// The regions in which the map has blocks, in unspecified order.
  std::vector<GridIndex> regions() const;
  bool hasRegion(const GridIndex& region) const { return region_position_.find(region) != kNoPosition; }
  std::size_t regionCount() const { return regions_.size(); }
  /// The position of a region, below regionCount(), or kNoPosition. Holds until the map is next changed.
  std::uint32_t positionOf(const GridIndex& region) const { return region_position_.find(region); }
  const Region& regionAt(std::uint32_t position) const { return *regions_[position].region; }
  /// @return nullptr if the map has no block in the region. While two maps exist that share blocks, equal
  /// regions and equal blocks are those that neither of them has changed since.
  const Region* findRegion(const GridIndex& region) const {
    const std::uint32_t position = positionOf(region);
    return position == kNoPosition ? nullptr : regions_[position].region.get();
  }
  /// Moves the blocks of a region to a map of their own, which has the same grid, prior and number of
  /// classes. Copies no block.
  /// @return an empty map if this one has no such region. @throws std::bad_alloc; the map is then unchanged.
  SemanticMap takeRegion(const GridIndex& region);

  /// Calls visit(index) for every block within `radius` of a point, and for some farther ones. The cost
  /// depends on the number of blocks near the point, not on the size of the map.
  /// @param point map frame [m]. @param radius [m].
  template <typename Visit>
  void forEachBlockNear(const Eigen::Vector3d& point, double radius, Visit&& visit) const {
    const double edge = Region::kEdge * geometry_.blockSize();
    const Eigen::Array3d low = ((point.array() - radius) / edge).floor();
    const Eigen::Array3d high = ((point.array() + radius) / edge).floor();
    if (!((high - low + 1.0).prod() < static_cast<double>(regions_.size()))) {
      for (const SharedRegion& shared : regions_) shared.region->forEachIndex(visit);
      return;
    }
    const Eigen::Array3i first = low.cast<int>(), last = high.cast<int>();
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int x = first.x(); x <= last.x(); ++x) {
          const std::uint32_t region = region_position_.find({x, y, z});
          if (region != kNoPosition) regions_[region].region->forEachIndex(visit);
        }
      }
    }
  }

  /// Adds the evidence of another map, so that this one holds the posterior of both sets of scans.
  /// @throws std::invalid_argument if the resolution, the prior or the number of classes differs,
  /// std::bad_alloc; the map is then unchanged.
  void add(const SemanticMap& other);
  /// The same, but takes the regions of the other map that this one lacks instead of copying their blocks.
  /// What the other map holds afterwards is not specified; if this throws, both maps are unchanged.
  void add(SemanticMap&& other);
  /// @throws std::invalid_argument if add() would.
  void checkAddable(const SemanticMap& other) const;

  /// Memory of all blocks and of the index [bytes], including what is shared with snapshots.
  std::size_t bytes() const;
  /// The part of bytes() that does not belong to the blocks in entries().
  std::size_t indexBytes() const;

 private:
  /// Regions are never empty.
  struct SharedRegion {
    std::shared_ptr<Region> region;
    bool shared;  ///< with a snapshot: must not be written to
  };

  /// The region of a block, to be written to. It is created if missing, and copied if it is shared.
  Region& writableRegion(const BlockIndex& block);
  /// Erases the region of a block if it is empty.
  void dropIfEmpty(const BlockIndex& block) noexcept;
  /// Removes a region from the index.
  void removeRegion(std::uint32_t position) noexcept;
  /// Takes a region out of the map.
  SharedRegion detach(const GridIndex& region) noexcept;
  /// Allocates what the map needs to attach() regions. @param blocks in all of them.
  void reserveRegions(std::size_t regions, std::size_t blocks);
  /// Adds a region that the map lacks.
  void attach(SharedRegion region) noexcept;
  /// A map with the same grid, prior and number of classes, and no blocks.
  SemanticMap emptyLikeThis() const;

  GridGeometry geometry_;
  double prior_;
  std::size_t class_count_;
  std::vector<SharedRegion> regions_;
  GridTable region_position_;  ///< of each region in regions_
  std::size_t size_ = 0;       ///< number of blocks
  // Their capacity suffices for the blocks and regions that were added here, so that erasing allocates
  // nothing:
  std::vector<std::shared_ptr<Block>> spare_blocks_;    ///< empty ones, to be reused
  std::vector<std::shared_ptr<Region>> spare_regions_;  ///< empty ones, to be reused
  std::size_t region_bytes_ = 0;                        ///< memory of the regions, also of those to be reused
  std::size_t spare_bytes_ = 0;                         ///< memory of the blocks in spare_blocks_
};

/// The blocks of a map, region by region.
class SemanticMap::Entries {
 public:
  class Iterator {
   public:
    Iterator(const std::vector<SharedRegion>& regions, std::size_t region)
        : regions_(&regions), region_(region) {
      if (region_ < regions_->size()) moveToNext(0);
    }
    Entry operator*() const {
      const Region& region = *(*regions_)[region_].region;
      return {region.blockIndex(number_), region.find(number_)};
    }
    Iterator& operator++() {
      moveToNext(number_ + 1);
      return *this;
    }
    bool operator!=(const Iterator& other) const {
      return region_ != other.region_ || number_ != other.number_;
    }

   private:
    /// Moves to the first present block from a number on.
    void moveToNext(int number) {
      const Region& region = *(*regions_)[region_].region;
      while (number < Region::kBlocks && !region.has(number)) ++number;
      number_ = number;
      if (number < Region::kBlocks) return;
      number_ = 0;
      if (++region_ < regions_->size()) moveToNext(0);  // at most once: regions are never empty
    }

    const std::vector<SharedRegion>* regions_;
    std::size_t region_;
    int number_ = 0;
  };

  explicit Entries(const std::vector<SharedRegion>& regions) : regions_(regions) {}
  Iterator begin() const { return Iterator(regions_, 0); }
  Iterator end() const { return Iterator(regions_, regions_.size()); }

 private:
  const std::vector<SharedRegion>& regions_;
};

inline SemanticMap::Entries SemanticMap::entries() const {
  return Entries(regions_);
}

/// All blocks, sorted by index (z, then y, then x), so that output does not depend on the order of creation.
std::vector<std::pair<BlockIndex, const Block*>> sortedBlocks(const SemanticMap& map);

/// Erases all evidence and occlusion marks of the voxels whose centres lie in a box or on its faces. They are
/// then unknown, as if no scan had reached them. Planes and blocks that become empty are erased.
/// @param box map frame [m]; may be infinite. @return the blocks that changed or were erased, sorted.
/// @throws std::bad_alloc; part of the box may then be cleared.
std::vector<GridIndex> clearBox(SemanticMap& map, const Eigen::AlignedBox3d& box);

/// Replaces the looks of all blocks that a map has in a region. @param looks of these blocks; the others have
/// none. @return the blocks that changed. @throws std::bad_alloc; part may then be replaced.
std::vector<GridIndex> replaceLooks(SemanticMap& map, const GridIndex& region, const LooksByBlock& looks);

}  // namespace bki_mapping
