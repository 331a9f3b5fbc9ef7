#include "bki_mapping/core/semantic_map.h"

#include <stdexcept>

namespace bki_mapping {

const Block* SemanticMap::find(const BlockIndex& index) const {
  const auto found = place_.find(index);
  return found == place_.end() ? nullptr : entries_[found->second].block.get();
}

Block& SemanticMap::getOrAllocate(const BlockIndex& index) {
  const auto [found, inserted] = place_.try_emplace(index, entries_.size());
  if (inserted) entries_.push_back({index, std::make_unique<Block>()});
  return *entries_[found->second].block;
}

void SemanticMap::erase(const BlockIndex& index) {
  const auto found = place_.find(index);
  if (found == place_.end()) return;
  const std::size_t hole = found->second;
  place_.erase(found);
  if (hole + 1 != entries_.size()) {
    entries_[hole] = std::move(entries_.back());
    place_[entries_[hole].index] = hole;
  }
  entries_.pop_back();
}

void SemanticMap::clear() {
  entries_.clear();
  place_.clear();
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
  std::size_t sum = entries_.capacity() * sizeof(Entry) + place_.bucket_count() * sizeof(void*) +
                    place_.size() * (sizeof(BlockIndex) + 3 * sizeof(std::size_t));
  for (const Entry& entry : entries_) sum += entry.block->bytes();
  return sum;
}

}  // namespace bki_mapping
