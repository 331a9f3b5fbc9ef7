/// @file The frontier voxels of a region, clustered as far as that can be told without other regions.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "bki_mapping/query/state_map.h"
#include "query/block_layers.h"
#include "query/voxel_rows.h"

namespace bki_mapping {

/// The voxels that a box overlaps.
class VoxelBox {
 public:
  /// @throws std::invalid_argument.
  VoxelBox(const GridGeometry& geometry, const Eigen::AlignedBox3d& box);

  bool overlaps(const BlockIndex& index) const {
    return bits(0, index.x) != 0 && bits(1, index.y) != 0 && bits(2, index.z) != 0;
  }
  bool overlapsRegion(const GridIndex& region) const;
  bool containsRegion(const GridIndex& region) const;
  /// Takes the voxels outside the box out of a block's.
  void cut(const BlockIndex& index, BlockLayers& layers) const;

 private:
  /// Those of a block's eight layers across an axis that are in the box. @param block its index on the axis.
  std::uint64_t bits(std::size_t axis, std::int32_t block) const;

  std::array<VoxelRange, 3> ranges_;
};

/// Groups what is connected: each element points to another one of its group, or is its group's root.
class Groups {
 public:
  std::uint32_t add() {
    next_.push_back(static_cast<std::uint32_t>(next_.size()));
    return next_.back();
  }
  std::size_t size() const { return next_.size(); }
  std::uint32_t rootOf(std::uint32_t element) {
    while (next_[element] != element) element = next_[element] = next_[next_[element]];
    return element;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = rootOf(a);
    b = rootOf(b);
    next_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> next_;
};

/// What is to be known of a set of voxels to describe it as a Frontier.
struct VoxelSum {
  std::size_t count = 0;
  std::array<std::int64_t, 3> sum{};  ///< of their indices, which is exact in any order
  VoxelIndex first;                   ///< in the order of GridIndex, if there is any

  void add(const VoxelSum& other);
};

/// The frontier voxels of a region. Depends on the states in the region and in the six beside it.
class RegionFrontiers {
 public:
  /// Voxels of a block that are connected within it.
  struct Piece {
    BlockIndex block;
    std::uint32_t part;  ///< the pieces of a region that are connected within it are a part
    BlockLayers voxels;
  };

  /// @param box leaves out voxels that it does not overlap; nullptr: none.
  RegionFrontiers(const StateMap& states, const Region& region, const VoxelBox* box);

  const std::vector<Piece>& pieces() const { return pieces_; }
  const std::vector<VoxelSum>& parts() const { return parts_; }
  /// Calls visit(piece) for the pieces of a block. @param number Region::numberOf.
  template <typename Visit>
  void forEachPieceOf(int number, Visit&& visit) const {
    const auto n = static_cast<std::size_t>(number);
    for (std::size_t p = begin_[n]; p < begin_[n + 1]; ++p) visit(pieces_[p]);
  }

 private:
  /// Clusters the pieces within the region. Sets their parts.
  void joinPieces();

  std::vector<Piece> pieces_;  ///< by the numbers of their blocks
  std::vector<VoxelSum> parts_;
  std::array<std::uint16_t, Region::kBlocks + 1> begin_;  ///< of each block's pieces in pieces_
};

}  // namespace bki_mapping
