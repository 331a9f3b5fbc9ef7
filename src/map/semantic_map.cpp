// The blocks that a scan changes are copied in src/update/map_updater.cpp.
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

Region& SemanticMap::writableRegion(const BlockIndex& block) {
  const GridIndex index = regionOf(block);
  const std::uint32_t known = region_position_.find(index);
  if (known != kNoPosition) {
    SharedRegion& shared = regions_[known];
    if (shared.shared) {
      std::shared_ptr<Region> copy = shared.region->sharingCopy();
      region_bytes_ += copy->bytes() - shared.region->bytes();
      shared = {std::move(copy), false};
    }
    return *shared.region;
  }
  // Allocate first, so that nothing after it can fail.
  growCapacity(regions_.size() + 1, regions_);
  growCapacity(regions_.size() + spare_regions_.size() + 1, spare_regions_);
  std::shared_ptr<Region> region = spare_regions_.empty() ? std::make_shared<Region>(index) : nullptr;
  region_position_.insert(index, static_cast<std::uint32_t>(regions_.size()));
  if (!region) {
    region = std::move(spare_regions_.back());
    spare_regions_.pop_back();
    spare_bytes_ -= region->bytes();
    region->reuseFor(index);
  }
  region_bytes_ += region->bytes();
  regions_.push_back({std::move(region), false});
  return *regions_.back().region;
}

void SemanticMap::dropIfEmpty(const BlockIndex& block) noexcept {
  const std::uint32_t position = region_position_.find(regionOf(block));
  const Region& region = *regions_[position].region;
  if (region.size() > 0) return;
  region_bytes_ -= region.bytes();
  if (spare_regions_.size() < spare_regions_.capacity()) {
    spare_bytes_ += region.bytes();
    spare_regions_.push_back(std::move(regions_[position].region));
  }
  region_position_.erase(regionOf(block));
  removeRegion(position);
}

void SemanticMap::removeRegion(std::uint32_t position) noexcept {
  if (position + 1 != regions_.size()) {
    regions_[position] = std::move(regions_.back());
    region_position_.set(regions_[position].region->index(), position);
  }
  regions_.pop_back();
}

const Block* SemanticMap::find(const BlockIndex& index) const {
  const std::uint32_t position = region_position_.find(regionOf(index));
  return position == kNoPosition ? nullptr : regions_[position].region->find(Region::numberOf(index));
}

SemanticMap::Claim SemanticMap::claim(const BlockIndex& index) {
  Region& region = writableRegion(index);
  const int number = Region::numberOf(index);
  if (Block* known = region.find(number)) return {known, false, !region.owns(number)};
  try {
    growCapacity(size_ + spare_blocks_.size() + 1, spare_blocks_);
    const std::size_t before = region.bytes();
    region.reserveOne();
    region_bytes_ += region.bytes() - before;
    if (spare_blocks_.empty()) {
      region.insert(number, std::make_shared<Block>());
    } else {
      spare_bytes_ -= spare_blocks_.back()->bytes();
      region.insert(number, std::move(spare_blocks_.back()));
      spare_blocks_.pop_back();
    }
  } catch (...) {
    dropIfEmpty(index);
    throw;
  }
  ++size_;
  return {region.find(number), true, false};
}

void SemanticMap::replace(const BlockIndex& index, std::shared_ptr<Block> block) noexcept {
  writableRegion(index).replace(Region::numberOf(index), std::move(block));
}

Block& SemanticMap::getOrAllocate(const BlockIndex& index) {
  const Claim claimed = claim(index);
  if (!claimed.shared) return *claimed.block;
  auto copy = std::make_shared<Block>(*claimed.block, 0);
  Block& block = *copy;
  replace(index, std::move(copy));
  return block;
}

void SemanticMap::erase(const BlockIndex& index) {
  if (!find(index)) return;
  const int number = Region::numberOf(index);
  Region& region = writableRegion(index);
  const bool own = region.owns(number);
  std::shared_ptr<Block> block = region.remove(number);
  --size_;
  dropIfEmpty(index);
  if (!own || !block->empty() || spare_blocks_.size() == spare_blocks_.capacity()) return;
  block->looks().clear();
  spare_bytes_ += block->bytes();
  spare_blocks_.push_back(std::move(block));
}

void SemanticMap::clear() noexcept {
  regions_ = decltype(regions_)();
  region_position_ = GridTable();
  size_ = 0;
  spare_blocks_ = decltype(spare_blocks_)();
  spare_regions_ = decltype(spare_regions_)();
  region_bytes_ = spare_bytes_ = 0;
}

std::vector<GridIndex> SemanticMap::regions() const {
  std::vector<GridIndex> indices;
  indices.reserve(regions_.size());
  for (const SharedRegion& region : regions_) indices.push_back(region.region->index());
  return indices;
}

SemanticMap SemanticMap::emptyLikeThis() const {
  return SemanticMap(geometry_, prior_, class_count_);
}

SemanticMap::SharedRegion SemanticMap::detach(const GridIndex& index) noexcept {
  const std::uint32_t position = region_position_.find(index);
  SharedRegion detached = std::move(regions_[position]);
  region_position_.erase(index);
  removeRegion(position);
  size_ -= detached.region->size();
  region_bytes_ -= detached.region->bytes();
  return detached;
}

void SemanticMap::reserveRegions(std::size_t regions, std::size_t blocks) {
  growCapacity(regions_.size() + regions, regions_);
  growCapacity(regions_.size() + spare_regions_.size() + regions, spare_regions_);
  growCapacity(size_ + spare_blocks_.size() + blocks, spare_blocks_);
  region_position_.reserve(regions_.size() + regions);
}

void SemanticMap::attach(SharedRegion region) noexcept {
  size_ += region.region->size();
  region_bytes_ += region.region->bytes();
  region_position_.insert(region.region->index(), static_cast<std::uint32_t>(regions_.size()));
  regions_.push_back(std::move(region));
}

SemanticMap SemanticMap::takeRegion(const GridIndex& index) {
  SemanticMap taken = emptyLikeThis();
  const std::uint32_t position = region_position_.find(index);
  if (position == kNoPosition) return taken;
  taken.reserveRegions(1, regions_[position].region->size());
  taken.attach(detach(index));
  return taken;
}

SemanticMap SemanticMap::snapshot() {
  SemanticMap copy = emptyLikeThis();
  copy.region_position_ = region_position_;
  copy.size_ = size_;
  copy.region_bytes_ = region_bytes_;
  for (SharedRegion& region : regions_) region.shared = true;
  copy.regions_ = regions_;
  return copy;
}

void SemanticMap::checkAddable(const SemanticMap& other) const {
  if (geometry_.resolution() != other.geometry_.resolution() || prior_ != other.prior_ ||
      class_count_ != other.class_count_) {
    throw std::invalid_argument(
        "maps can only be added if resolution, prior and number of classes are the same in both");
  }
}

void SemanticMap::add(const SemanticMap& other) {
  checkAddable(other);
  try {  // allocates all that the sum takes
    for (const Entry& entry : other.entries()) {
      Block& block = getOrAllocate(entry.index);
      block.reserve(block.newClassesOf(*entry.block));
      block.looks().reserve(entry.block->looks());
    }
  } catch (...) {
    for (const Entry& entry : other.entries()) {
      const Block* const block = find(entry.index);
      if (block && block->empty()) erase(entry.index);
    }
    throw;
  }
  for (const Entry& entry : other.entries()) {
    Block& block = getOrAllocate(entry.index);
    const auto& classes = entry.block->classes();
    for (std::size_t i = 0; i < classes.size(); ++i) block.add(classes[i], entry.block->plane(i));
    block.setOcclusion(block.occlusion() | entry.block->occlusion());
    block.looks().add(entry.block->looks());
    if (block.empty()) erase(entry.index);  // negative evidence may have undone all of it
  }
}

void SemanticMap::add(SemanticMap&& other) {
  checkAddable(other);
  std::vector<GridIndex> missing;
  std::size_t blocks = 0;
  for (const SharedRegion& shared : other.regions_) {
    if (hasRegion(shared.region->index())) continue;
    missing.push_back(shared.region->index());
    blocks += shared.region->size();
  }
  reserveRegions(missing.size(), blocks);
  std::vector<SharedRegion> moved;
  moved.reserve(missing.size());
  for (const GridIndex& index : missing) moved.push_back(other.detach(index));
  try {
    add(std::as_const(other));
  } catch (...) {
    for (SharedRegion& region : moved) other.attach(std::move(region));  // its memory is still there
    throw;
  }
  for (SharedRegion& region : moved) attach(std::move(region));
}

std::size_t SemanticMap::indexBytes() const {
  return region_bytes_ + spare_bytes_ + region_position_.bytes() + regions_.capacity() * sizeof(regions_[0]) +
         spare_blocks_.capacity() * sizeof(spare_blocks_[0]) +
         spare_regions_.capacity() * sizeof(spare_regions_[0]);
}

std::size_t SemanticMap::bytes() const {
  std::size_t sum = indexBytes();
  for (const Entry& entry : entries()) sum += entry.block->bytes();
  return sum;
}

std::vector<std::pair<BlockIndex, const Block*>> sortedBlocks(const SemanticMap& map) {
  std::vector<std::pair<BlockIndex, const Block*>> blocks;
  blocks.reserve(map.size());
  for (const auto& [index, block] : map.entries()) blocks.emplace_back(index, block);
  std::sort(blocks.begin(), blocks.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return blocks;
}

}  // namespace bki_mapping
