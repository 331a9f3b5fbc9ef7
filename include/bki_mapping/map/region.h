/// @file The blocks of a region, a cube of 8 x 8 x 8 blocks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/map/block.h"

namespace bki_mapping {

/// The blocks that a map holds in one region. Maps share regions with their snapshots, and a region shares
/// blocks with its copies: a region knows which of its blocks are its own. A map writes only to those, and
/// only if the region itself is not shared.
class Region {
 public:
  static constexpr int kEdge = 8;  ///< [blocks]
  static constexpr int kBlocks = kEdge * kEdge * kEdge;

  /// The region of a block, and the block's number in it, 0 to kBlocks - 1.
  static GridIndex regionOf(const BlockIndex& block) {
    static_assert(kEdge == kBlockEdge, "blocks lie in a region as voxels lie in a block");
    return GridGeometry::blockOf({block});
  }
  static int numberOf(const BlockIndex& block) { return GridGeometry::offsetInBlock({block}); }

  explicit Region(const GridIndex& index) : index_(index) {}

  const GridIndex& index() const { return index_; }
  BlockIndex blockIndex(int number) const { return {GridGeometry::voxelOf({index_}, number)}; }

  /// @param number of the block.
  bool has(int number) const { return contains(present_, number); }
  /// Whether no other region shares the block, which must be present.
  bool owns(int number) const { return contains(own_, number); }
  const Block* find(int number) const { return has(number) ? blocks_[positionOf(number)].get() : nullptr; }
  Block* find(int number) { return has(number) ? blocks_[positionOf(number)].get() : nullptr; }
  std::size_t size() const { return blocks_.size(); }

  /// Calls visit(const BlockIndex&) for each block, by rising number.
  template <typename Visit>
  void forEachIndex(Visit&& visit) const {
    for (int number = 0; number < kBlocks; ++number) {
      if (has(number)) visit(blockIndex(number));
    }
  }

  /// Allocates memory for one more block. Repeated calls take amortised constant time.
  void reserveOne() {
    if (blocks_.size() == blocks_.capacity()) blocks_.reserve(blocks_.size() + blocks_.size() / 2 + 4);
  }
  /// Adds an own block; reserveOne() has been called, and the number is not taken.
  void insert(int number, std::shared_ptr<Block> block) noexcept {
    blocks_.insert(at(positionOf(number)), std::move(block));
    set(present_, number, true);
    set(own_, number, true);
    for (std::size_t word = wordOf(number) + 1; word < kWords; ++word) ++before_[word];
  }
  /// Replaces a block by an own one. @return the block that was there.
  std::shared_ptr<Block> replace(int number, std::shared_ptr<Block> block) noexcept {
    set(own_, number, true);
    std::swap(blocks_[positionOf(number)], block);
    return block;
  }
  /// Removes a block. @return the block.
  std::shared_ptr<Block> remove(int number) noexcept {
    const auto position = at(positionOf(number));
    std::shared_ptr<Block> block = std::move(*position);
    blocks_.erase(position);
    set(present_, number, false);
    set(own_, number, false);
    for (std::size_t word = wordOf(number) + 1; word < kWords; ++word) --before_[word];
    return block;
  }

  /// A copy that shares all blocks with this region, and owns none. This region must not be written to any
  /// more, although it still regards its blocks as its own.
  std::shared_ptr<Region> sharingCopy() const {
    auto copy = std::make_shared<Region>(*this);
    copy->own_ = {};
    return copy;
  }
  /// Makes an empty region another one; keeps its memory.
  void reuseFor(const GridIndex& index) { index_ = index; }

  /// Memory without the blocks, including this object and its reference count [bytes].
  std::size_t bytes() const {
    return sizeof(*this) + kReferenceCountBytes + blocks_.capacity() * sizeof(blocks_[0]);
  }

 private:
  static constexpr std::size_t kWordBits = 64, kWords = kBlocks / kWordBits;
  using Mask = std::array<std::uint64_t, kWords>;

  static std::size_t wordOf(int number) { return static_cast<std::size_t>(number) / kWordBits; }
  static std::uint64_t bitOf(int number) {
    return std::uint64_t{1} << (static_cast<unsigned>(number) % kWordBits);
  }
  static bool contains(const Mask& mask, int number) { return (mask[wordOf(number)] & bitOf(number)) != 0; }
  static void set(Mask& mask, int number, bool value) {
    std::uint64_t& word = mask[wordOf(number)];
    word = value ? word | bitOf(number) : word & ~bitOf(number);
  }
  /// The number of present blocks with smaller numbers.
  std::size_t positionOf(int number) const {
    const std::uint64_t smaller = present_[wordOf(number)] & (bitOf(number) - 1);
    return before_[wordOf(number)] + static_cast<std::size_t>(__builtin_popcountll(smaller));
  }
  std::vector<std::shared_ptr<Block>>::iterator at(std::size_t position) {
    return blocks_.begin() + static_cast<std::ptrdiff_t>(position);
  }

  GridIndex index_;
  Mask present_{}, own_{};
  std::array<std::uint16_t, kWords> before_{};  ///< for each word, the bits set in the words before it
  std::vector<std::shared_ptr<Block>> blocks_;  ///< those present, by rising number
};

}  // namespace bki_mapping
