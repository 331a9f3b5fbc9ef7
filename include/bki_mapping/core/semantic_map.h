/// @file The map: blocks by index.
#pragma once

#include <cstddef>
#include <memory>
#include <unordered_map>
#include <vector>

#include "bki_mapping/core/block.h"
#include "bki_mapping/core/grid_geometry.h"

namespace bki_mapping {

/// A sparse grid of Dirichlet posteriors. A voxel's concentrations are alpha[k] = prior + evidence[k] for
/// every class of the table and for `free`.
class SemanticMap {
 public:
  struct Entry {
    BlockIndex index;
    std::unique_ptr<Block> block;
  };

  /// @param prior concentration alpha0 of each class before any scan, > 0.
  /// @param class_count number of classes in the table, `free` not counted, 1 to 254.
  SemanticMap(const GridGeometry& geometry, double prior, std::size_t class_count)
      : geometry_(geometry), prior_(prior), class_count_(class_count) {}

  const GridGeometry& geometry() const { return geometry_; }
  double prior() const { return prior_; }
  std::size_t classCount() const { return class_count_; }
  /// Sum of a voxel's concentrations before any scan.
  double priorSum() const { return prior_ * static_cast<double>(class_count_ + 1); }

  /// All blocks, in no promised order.
  const std::vector<Entry>& entries() const { return entries_; }
  std::size_t size() const { return entries_.size(); }

  /// @return nullptr where no block is.
  const Block* find(const BlockIndex& index) const;
  Block& getOrAllocate(const BlockIndex& index);
  void erase(const BlockIndex& index);
  void clear();

  /// Adds another map's evidence: the posterior of both sets of scans.
  /// @throws std::invalid_argument if resolution, prior or number of classes differ.
  void add(const SemanticMap& other);

  /// Bytes of all blocks and of the index, as allocated.
  std::size_t bytes() const;

 private:
  GridGeometry geometry_;
  double prior_;
  std::size_t class_count_;
  std::vector<Entry> entries_;
  std::unordered_map<BlockIndex, std::size_t, GridIndexHash> place_;
};

}  // namespace bki_mapping
