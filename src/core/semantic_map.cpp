#include "bki_mapping/core/semantic_map.h"

#include <stdexcept>
#include <utility>

namespace bki_mapping {

GridIndex SemanticMap::regionOf(const BlockIndex& block) {
  static_assert(kRegionEdge == kBlockEdge, "blocks lie in a region as voxels lie in a block");
  return GridGeometry::blockOf({block});
}

std::vector<std::uint32_t>& SemanticMap::regionAt(const BlockIndex& block) {
  const auto fresh = static_cast<std::uint32_t>(regions_.size());
  const std::uint32_t number = region_number_.insert(regionOf(block), fresh);
  if (number == fresh) {
    regions_.push_back({regionOf(block), {}});
    if (!spare_places_.empty()) {
      regions_.back().places = std::move(spare_places_.back());
      spare_places_.pop_back();
    }
  }
  return regions_[number].places;
}

void SemanticMap::dropIfEmpty(const BlockIndex& block) {
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

SemanticMap::Entry& SemanticMap::entry(const BlockIndex& index) {
  const auto fresh = static_cast<std::uint32_t>(entries_.size());
  const std::uint32_t place = place_.insert(index, fresh);
  if (place == fresh) {
    std::vector<std::uint32_t>& region = regionAt(index);
    entries_.push_back({index, nullptr, static_cast<std::uint32_t>(region.size())});
    region.push_back(place);
    if (spare_.empty()) {
      entries_.back().block = std::make_unique<Block>();
    } else {
      entries_.back().block = std::move(spare_.back());
      spare_.pop_back();
    }
  }
  return entries_[place];
}

void SemanticMap::erase(const BlockIndex& index) {
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
  if (entries_[hole].block->empty()) spare_.push_back(std::move(entries_[hole].block));
  if (hole + 1 != entries_.size()) {
    Entry& last = entries_.back();
    place_.set(last.index, hole);
    regionAt(last.index)[last.place_in_region] = hole;
    entries_[hole] = std::move(last);
  }
  entries_.pop_back();
}

void SemanticMap::clear() {
  entries_.clear();
  place_.clear();
  regions_.clear();
  region_number_.clear();
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

std::size_t SemanticMap::bytes() const {
  std::size_t sum = entries_.capacity() * sizeof(Entry) + place_.bytes() + region_number_.bytes() +
                    regions_.capacity() * sizeof(regions_[0]) + spare_.capacity() * sizeof(spare_[0]) +
                    spare_.size() * sizeof(Block);
  sum += spare_places_.capacity() * sizeof(spare_places_[0]);
  for (const Region& region : regions_) sum += region.places.capacity() * sizeof(region.places[0]);
  for (const auto& places : spare_places_) sum += places.capacity() * sizeof(places[0]);
  for (const Entry& entry : entries_) sum += entry.block->bytes();
  return sum;
}

}  // namespace bki_mapping
