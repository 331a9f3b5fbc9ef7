#include "bki_mapping/map/semantic_map.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace bki_mapping {
namespace {

/// Makes room for so many elements in all; at least doubles what there is, so that it is seldom called for.
template <typename T>
void makeRoom(std::size_t size, std::vector<T>& elements) {
  if (elements.capacity() < size) elements.reserve(std::max(size, 2 * elements.capacity()));
}

}  // namespace

GridIndex SemanticMap::regionOf(const BlockIndex& block) {
  static_assert(kRegionEdge == kBlockEdge, "blocks lie in a region as voxels lie in a block");
  return GridGeometry::blockOf({block});
}

std::vector<std::uint32_t>& SemanticMap::regionAt(const BlockIndex& block) {
  const std::uint32_t known = region_number_.find(regionOf(block));
  if (known != GridTable::kNone) return regions_[known].places;
  // What takes memory comes first; then nothing can fail.
  makeRoom(regions_.size() + 1, regions_);
  makeRoom(regions_.size() + spare_places_.size() + 1, spare_places_);
  region_number_.insert(regionOf(block), static_cast<std::uint32_t>(regions_.size()));
  regions_.push_back({regionOf(block), {}});
  if (!spare_places_.empty()) {
    regions_.back().places = std::move(spare_places_.back());
    spare_places_.pop_back();
  }
  return regions_.back().places;
}

void SemanticMap::dropIfEmpty(const BlockIndex& block) noexcept {
  const std::uint32_t number = region_number_.find(regionOf(block));
  if (!regions_[number].places.empty()) return;
  spare_places_.push_back(std::move(regions_[number].places));
  region_number_.erase(regions_[number].index);
  if (number + 1 != regions_.size()) {
    regions_[number] = std::move(regions_.back());
    region_number_.set(regions_[number].index, number);
  }
  regions_.pop_back();
}

const Block* SemanticMap::find(const BlockIndex& index) const {
  const std::uint32_t place = place_.find(index);
  return place == GridTable::kNone ? nullptr : entries_[place].block.get();
}

void SemanticMap::append(const BlockIndex& index) {
  // What takes memory comes first; then nothing can fail.
  makeRoom(entries_.size() + 1, entries_);
  makeRoom(entries_.size() + spare_.size() + 1, spare_);
  std::vector<std::uint32_t>& region = regionAt(index);
  try {
    makeRoom(region.size() + 1, region);
    std::unique_ptr<Block> block = spare_.empty() ? std::make_unique<Block>() : nullptr;
    place_.insert(index, static_cast<std::uint32_t>(entries_.size()));
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
  const std::uint32_t place = place_.find(index);
  if (place != GridTable::kNone) return place;
  append(index);
  return entries_.size() - 1;
}

void SemanticMap::erase(const BlockIndex& index) noexcept {
  const std::uint32_t hole = place_.find(index);
  if (hole == GridTable::kNone) return;
  const auto removeFrom = [this](std::vector<std::uint32_t>& region, std::uint32_t place) {
    region[place] = region.back();
    entries_[region[place]].place_in_region = place;
    region.pop_back();
  };
  removeFrom(regionAt(index), entries_[hole].place_in_region);
  dropIfEmpty(index);
  place_.erase(index);
  if (entries_[hole].block->empty()) {
    spare_bytes_ += entries_[hole].block->bytes();
    spare_.push_back(std::move(entries_[hole].block));
  }
  if (hole + 1 != entries_.size()) {
    Entry& last = entries_.back();
    place_.set(last.index, hole);
    regionAt(last.index)[last.place_in_region] = hole;
    entries_[hole] = std::move(last);
  }
  entries_.pop_back();
}

void SemanticMap::clear() noexcept {
  entries_ = decltype(entries_)();
  place_ = GridTable();
  regions_ = decltype(regions_)();
  region_number_ = GridTable();
  spare_ = decltype(spare_)();
  spare_places_ = decltype(spare_places_)();
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
  }
}

std::size_t SemanticMap::indexBytes() const {
  std::size_t sum = entries_.capacity() * sizeof(Entry) + place_.bytes() + region_number_.bytes() +
                    regions_.capacity() * sizeof(regions_[0]) + spare_.capacity() * sizeof(spare_[0]) +
                    spare_places_.capacity() * sizeof(spare_places_[0]) + spare_bytes_;
  for (const Region& region : regions_) sum += region.places.capacity() * sizeof(region.places[0]);
  for (const auto& places : spare_places_) sum += places.capacity() * sizeof(places[0]);
  return sum;
}

std::size_t SemanticMap::bytes() const {
  std::size_t sum = indexBytes();
  for (const Entry& entry : entries_) sum += entry.block->bytes();
  return sum;
}

}  // namespace bki_mapping
