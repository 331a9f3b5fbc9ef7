#include "bki_mapping/map/looks.h"

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping {

void Looks::insert(const Look& look) {
  const auto later = [](const Look& a, const Look& b) { return a.begin_ < b.begin_; };
  looks_.insert(std::upper_bound(looks_.begin(), looks_.end(), look, later), look);
}

void Looks::coarsen() {
  if (looks_.empty()) return;
  const std::uint64_t newest = looks_.back().begin_;  // the latest interval is a tick
  auto last = looks_.begin();
  bool any = false;
  for (auto next = looks_.begin(); next != looks_.end(); ++next) {
    if (next->seen().none() && next + 1 != looks_.end()) continue;  // was the latest
    const unsigned level = levelAt(newest, next->begin_);
    next->begin_ = next->begin_ >> level << level;
    next->level_ = level;
    if (any && last->begin_ == next->begin_ && last->level_ == level) {
      last->join(*next);
      continue;
    }
    if (any) ++last;
    if (last != next) *last = *next;
    any = true;
  }
  looks_.erase(last + 1, looks_.end());
}

void Looks::add(const Look& look) {
  if (look.seen().none()) return;
  if (!looks_.empty() && looks_.back().begin_ == look.begin_ && look.level_ == 0) {
    looks_.back().join(look);
    return;
  }
  insert(look);
  coarsen();
}

void Looks::add(const Looks& other) {
  if (other.empty()) return;
  for (const Look& look : other.looks_) insert(look);
  coarsen();
}

bool Looks::isCanonical() const {
  for (std::size_t n = 0; n < looks_.size(); ++n) {
    const Look& look = looks_[n];
    const bool follows =
        n == 0 || looks_[n - 1].begin_<look.begin_, is_latest_of_many = n> 0 && n + 1 == looks_.size();
    const std::uint64_t newest = looks_.back().begin_;
    if (!follows || newest > Look::tickOf(~std::uint64_t{0}) || look.begin_ > newest ||
        look.level_ != levelAt(newest, look.begin_) ||
        look.begin_ >> look.level_ << look.level_ != look.begin_ ||
        (look.seen().none() && !is_latest_of_many)) {
      return false;
    }
  }
  return true;
}

void Looks::erase(const Look::Voxels& voxels) {
  moveVoxels([&](Look::Voxels& mask) { mask &= ~voxels; });
}

void Looks::subtract(Looks other) {
  if (empty() || other.empty()) return;
  other.insert(Look(looks_.back().begin_, 0, {}, {}));
  other.coarsen();
  for (const Look& of_other : other.looks_) {
    for (Look& look : looks_) {
      if (look.begin_ != of_other.begin_ || look.level_ != of_other.level_) continue;
      const Look::Voxels different = (look.low_ ^ of_other.low_) | (look.high_ ^ of_other.high_);
      look.low_ &= different;
      look.high_ &= different;
    }
  }
  dropEmpty();
}

void Looks::dropEmpty() {
  const auto saw_nothing = [](const Look& look) { return look.seen().none(); };
  if (std::all_of(looks_.begin(), looks_.end(), saw_nothing)) {
    looks_.clear();
  } else {
    const auto latest = looks_.end() - 1;
    looks_.erase(std::remove_if(looks_.begin(), latest, saw_nothing), latest);
  }
}

std::vector<GridIndex> replaceLooks(SemanticMap& map, const GridIndex& region, const LooksByBlock& looks) {
  static const Looks kNone;
  std::vector<BlockIndex> blocks;  // listed first: writing may copy the region
  if (const Region* const known = map.findRegion(region)) {
    known->forEachIndex([&](const BlockIndex& index) { blocks.push_back(index); });
  }
  std::vector<GridIndex> changed;
  for (const BlockIndex& index : blocks) {
    const auto found = looks.find(index);
    const Looks& now = found == looks.end() ? kNone : found->second;
    if (map.find(index)->looks() == now) continue;
    map.getOrAllocate(index).looks() = now;
    changed.push_back(index);
  }
  return changed;
}

}  // namespace bki_mapping
