/// @file The map: blocks by index.
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
    std::uint32_t place_in_region;
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

  /// Gain on the evidence for `free` when the state of a voxel is decided whose likeliest class is `id`; 1
  /// unless set. With a persistence P > 0, a gain above 1 falls towards 1 with the evidence for the class, by
  /// exp(-hits / P): what is hit scan after scan stands, even if it could move.
  /// @param hits evidence for the class.
  float freeGain(ClassId id, float hits) const {
    const float gain = free_gains_[id];
    if (gain <= 1.0f || gain_persistence_ <= 0.0f) return gain;
    return 1.0f + (gain - 1.0f) * std::exp(-hits / gain_persistence_);
  }
  void setFreeGain(ClassId id, double gain) { free_gains_[id] = static_cast<float>(gain); }
  /// @param persistence in units of evidence; 0: gains are the same however much evidence there is.
  void setGainPersistence(double persistence) { gain_persistence_ = static_cast<float>(persistence); }

  /// All blocks, in no promised order.
  const std::vector<Entry>& entries() const { return entries_; }
  std::size_t size() const { return entries_.size(); }

  /// @return nullptr where no block is.
  const Block* find(const BlockIndex& index) const;
  Block& getOrAllocate(const BlockIndex& index) { return *entries_[positionOf(index)].block; }
  /// The position in entries() of a block, which is created where missing. It holds until a block is erased.
  /// @throws std::bad_alloc; the map is then as it was.
  std::size_t positionOf(const BlockIndex& index);
  void erase(const BlockIndex& index) noexcept;
  /// Erases all blocks, and gives back their memory and that of the index.
  void clear() noexcept;

  /// A region is a cube of this many blocks a side.
  static constexpr int kRegionEdge = 8;
  static GridIndex regionOf(const BlockIndex& block);

  /// Calls visit(index) for every block whose box comes within `radius` of a point, and for some around
  /// those. Costs as much as there are blocks near the point, however large the map.
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
          const std::uint32_t number = region_number_.find({x, y, z});
          if (number == GridTable::kNone) continue;
          for (const std::uint32_t place : regions_[number].places) visit(entries_[place].index);
        }
      }
    }
  }

  /// Adds another map's evidence: the posterior of both sets of scans.
  /// @throws std::invalid_argument if resolution, prior or number of classes differ.
  void add(const SemanticMap& other);

  /// Bytes of all blocks and of the index, as allocated.
  std::size_t bytes() const;
  /// The part of bytes() that is not of the blocks in entries(). Costs as much as there are regions.
  std::size_t indexBytes() const;

 private:
  /// A cube of blocks.
  struct Region {
    GridIndex index;
    std::vector<std::uint32_t> places;  ///< of its blocks in entries_
  };

  /// Adds an entry that is not there yet. @throws std::bad_alloc; the map is then as it was.
  void append(const BlockIndex& index);
  std::vector<std::uint32_t>& regionAt(const BlockIndex& block);
  /// Forgets the region of a block if it holds none.
  void dropIfEmpty(const BlockIndex& block) noexcept;

  GridGeometry geometry_;
  double prior_;
  std::size_t class_count_;
  std::array<float, 256> free_gains_;
  float gain_persistence_ = 0.0f;
  std::vector<Entry> entries_;
  GridTable place_;  ///< of each block in entries_
  std::vector<Region> regions_;
  GridTable region_number_;
  // Both have room for all blocks and regions there are, so that erasing takes no memory:
  std::vector<std::unique_ptr<Block>> spare_;             ///< empty blocks, for use again
  std::vector<std::vector<std::uint32_t>> spare_places_;  ///< of regions that are gone, for use again
  std::size_t spare_bytes_ = 0;                           ///< of the blocks in spare_
};

}  // namespace bki_mapping
