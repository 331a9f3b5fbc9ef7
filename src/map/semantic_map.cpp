#include "bki_mapping/map/semantic_map.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace bki_mapping {
namespace {

/// Reserves capacity for `size` elements. Capacity at least doubles, so that repeated calls take amortised
/// constant time, which vector::reserve does not promise.
template <typename T>
void growCapacity(std::size_t size, std::vector<T>& elements) {
  if (elements.capacity() < size) elements.reserve(std::max(size, 2 * elements.capacity()));
}

}  // namespace

GridIndex SemanticMap::regionOf(const BlockIndex& block) {
  static_assert(kRegionEdge == kBlockEdge, "blocks lie in a region as voxels lie in a block");
  return GridGeometry::blockOf({block});
}

std::vector<std::uint32_t>& SemanticMap::regionAt(const BlockIndex& block) {
  const std::uint32_t known = region_position_.find(regionOf(block));
  if (known != kNoPosition) return regions_[known].entries;
  // Allocate first, so that nothing after it can fail.
  growCapacity(regions_.size() + 1, regions_);
  growCapacity(regions_.size() + spare_lists_.size() + 1, spare_lists_);
  region_position_.insert(regionOf(block), static_cast<std::uint32_t>(regions_.size()));
  regions_.push_back({regionOf(block), {}});
  if (!spare_lists_.empty()) {
    regions_.back().entries = std::move(spare_lists_.back());
    spare_lists_.pop_back();
  }
  return regions_.back().entries;
}

void SemanticMap::dropIfEmpty(const BlockIndex& block) noexcept {
  const std::uint32_t position = region_position_.find(regionOf(block));
  if (!regions_[position].entries.empty()) return;
  spare_lists_.push_back(std::move(regions_[position].entries));
  region_position_.erase(regions_[position].index);
  if (position + 1 != regions_.size()) {
    regions_[position] = std::move(regions_.back());
    region_position_.set(regions_[position].index, position);
  }
  regions_.pop_back();
}

const Block* SemanticMap::find(const BlockIndex& index) const {
  const std::uint32_t position = position_.find(index);
  return position == kNoPosition ? nullptr : entries_[position].block.get();
}

void SemanticMap::append(const BlockIndex& index) {
  // Allocate first, so that nothing after it can fail.
  growCapacity(entries_.size() + 1, entries_);
  growCapacity(entries_.size() + spare_.size() + 1, spare_);
  std::vector<std::uint32_t>& region = regionAt(index);
  try {
    growCapacity(region.size() + 1, region);
    std::unique_ptr<Block> block = spare_.empty() ? std::make_unique<Block>() : nullptr;
    position_.insert(index, static_cast<std::uint32_t>(entries_.size()));
    if (!block) {
      block = std::move(spare_.back());
      spare_bytes_ -= block->bytes();
      spare_.pop_back();
    }
    entries_.push_back({index, std::move(block), static_cast<std::uint32_t>(region.size())});
  } catch (...) {
    dropIfEmpty(index);
    throw;
  }
  region.push_back(static_cast<std::uint32_t>(entries_.size() - 1));
}

std::size_t SemanticMap::positionOf(const BlockIndex& index) {
  const std::uint32_t position = position_.find(index);
  if (position != kNoPosition) return position;
  append(index);
  return entries_.size() - 1;
}

void SemanticMap::erase(const BlockIndex& index) noexcept {
  const std::uint32_t hole = position_.find(index);
  if (hole == kNoPosition) return;
  const auto removeFrom = [this](std::vector<std::uint32_t>& region, std::uint32_t position) {
    region[position] = region.back();
    entries_[region[position]].position_in_region = position;
    region.pop_back();
  };
  removeFrom(regionAt(index), entries_[hole].position_in_region);
  dropIfEmpty(index);
  position_.erase(index);
  if (entries_[hole].block->empty()) {
    spare_bytes_ += entries_[hole].block->bytes();
    spare_.push_back(std::move(entries_[hole].block));
  }
  if (hole + 1 != entries_.size()) {
    Entry& last = entries_.back();
    position_.set(last.index, hole);
    regionAt(last.index)[last.position_in_region] = hole;
    entries_[hole] = std::move(last);
  }
  entries_.pop_back();
}

void SemanticMap::clear() noexcept {
  entries_ = decltype(entries_)();
  position_ = GridTable();
  regions_ = decltype(regions_)();
  region_position_ = GridTable();
  spare_ = decltype(spare_)();
  spare_lists_ = decltype(spare_lists_)();
  spare_bytes_ = 0;
}

void SemanticMap::add(const SemanticMap& other) {
  if (geometry_.resolution() != other.geometry_.resolution() || prior_ != other.prior_ ||
      class_count_ != other.class_count_) {
    throw std::invalid_argument(
        "maps can only be added if resolution, prior and number of classes are the same in both");
  }
  for (const Entry& entry : other.entries_) {
    Block& block = getOrAllocate(entry.index);
    const auto& classes = entry.block->classes();
    for (std::size_t i = 0; i < classes.size(); ++i) block.add(classes[i], entry.block->plane(i));
    block.setOcclusion(block.occlusion() | entry.block->occlusion());
    if (block.empty()) erase(entry.index);  // negative evidence may have undone all of it
  }
}

std::size_t SemanticMap::indexBytes() const {
  std::size_t sum = entries_.capacity() * sizeof(Entry) + position_.bytes() + region_position_.bytes() +
                    regions_.capacity() * sizeof(regions_[0]) + spare_.capacity() * sizeof(spare_[0]) +
                    spare_lists_.capacity() * sizeof(spare_lists_[0]) + spare_bytes_;
  for (const Region& region : regions_) sum += region.entries.capacity() * sizeof(region.entries[0]);
  for (const auto& list : spare_lists_) sum += list.capacity() * sizeof(list[0]);
  return sum;
}

std::size_t SemanticMap::bytes() const {
  std::size_t sum = indexBytes();
  for (const Entry& entry : entries_) sum += entry.block->bytes();
  return sum;
}

}  // namespace bki_mapping
