#include "bki_mapping/map/looks.h"

#include <algorithm>

#include "bki_mapping/map/semantic_map.h"
#include "map/voxel_mask.h"

namespace bki_mapping {
namespace {

/// No look has this level.
constexpr unsigned kNoLevel = 63;
/// Memory that may stay unused when looks have been joined [words].
constexpr std::size_t kMostSpare = 16;

}  // namespace

StoredLook::Words StoredLook::words() const {
  Words words{};
  const std::uint64_t* next = head_;
  for (std::uint64_t left = *head_ & kPresent; left != 0; left &= left - 1) {
    words[static_cast<std::size_t>(__builtin_ctzll(left))] = *++next;
  }
  return words;
}

Look StoredLook::unpacked() const {
  const Words words = this->words();
  LayerBits low, high;
  std::copy_n(words.begin(), low.size(), low.begin());
  std::copy_n(words.begin() + low.size(), high.size(), high.begin());
  return {begin(), level(), maskOf(low), maskOf(high)};
}

/// A look as it is stored.
struct Looks::Packed {
  using Bits = StoredLook::Words;

  Packed(std::uint64_t begin, unsigned level, const Bits& bits) {
    std::uint64_t present = 0;
    for (std::size_t n = 0; n < bits.size(); ++n) {
      words[size] = bits[n];
      size += bits[n] != 0;
      present |= std::uint64_t{bits[n] != 0} << n;
    }
    words[0] = begin << Look::kTickBits | (size - 1) << StoredLook::kCountShift |
               std::uint64_t{level} << StoredLook::kLevelShift | present;
  }
  explicit Packed(const Look& look) : Packed(look.begin_, look.level_, bitsOf(look)) {}
  explicit Packed(const StoredLook& look) : size(look.size()) {
    std::copy_n(look.head_, size, words.begin());
  }

  static Bits bitsOf(const Look& look) {
    const LayerBits low = bki_mapping::bitsOf(look.low_), high = bki_mapping::bitsOf(look.high_);
    Bits bits;
    std::copy(high.begin(), high.end(), std::copy(low.begin(), low.end(), bits.begin()));
    return bits;
  }
  /// The strongest sights of two looks; no more words than the two have.
  static Bits join(const Bits& a, const Bits& b) {
    Bits bits;
    for (std::size_t low = 0, high = kBlockEdge; low < kBlockEdge; ++low, ++high) {
      const std::uint64_t hit = (a[low] & a[high]) | (b[low] & b[high]);
      bits[high] = a[high] | b[high];
      bits[low] = hit | ((a[low] | b[low]) & ~bits[high]);
    }
    return bits;
  }

  std::array<std::uint64_t, StoredLook::kMostWords> words;
  std::size_t size = 1;
};

std::vector<Look> Looks::all() const {
  std::vector<Look> looks;
  looks.reserve(size());
  for (const StoredLook& look : *this) looks.push_back(look.unpacked());
  std::reverse(looks.begin(), looks.end());
  return looks;
}

void Looks::reserveTick(std::uint64_t tick) {
  const bool is_known = !empty() && begin()->begin() == tick;
  const std::size_t most = words_.size() + StoredLook::kMostWords - (is_known ? begin()->size() : 0);
  const bool has_shrunk = !is_known && words_.capacity() > most + kMostSpare;
  if (words_.capacity() >= most && !has_shrunk) return;
  std::vector<std::uint64_t> words;
  words.reserve(most);
  words.assign(words_.begin(), words_.end());
  words_.swap(words);
}

void Looks::replace(std::size_t position, std::size_t count, const Packed& look) {
  const auto begin = words_.begin() + static_cast<std::ptrdiff_t>(position);
  const std::size_t common = std::min(count, look.size);
  const auto rest = std::copy_n(look.words.begin(), common, begin);
  if (count > common) {
    words_.erase(rest, begin + static_cast<std::ptrdiff_t>(count));
  } else if (look.size > common) {
    words_.insert(rest, look.words.begin() + common, look.words.begin() + look.size);
  }
}

void Looks::insert(const Packed& look) {
  const std::uint64_t time = StoredLook(look.words.data()).begin();
  const auto next = std::find_if(begin(), end(), [&](const StoredLook& l) { return l.begin() <= time; });
  replace(static_cast<std::size_t>(next->head_ - words_.data()), 0, look);
}

void Looks::coarsen() {
  if (empty()) return;
  const std::uint64_t newest = begin()->begin();  // the latest interval is a tick
  std::size_t last = 0, end = 0;  // of what is kept: the position of the last look, and the end
  for (std::size_t next = 0, size = 0; next < words_.size(); next += size) {
    std::uint64_t* const words = words_.data();
    const StoredLook look(words + next), before(words + last);
    size = look.size();
    if (!look.hasSeen() && next > 0) continue;  // was the latest
    const unsigned level = levelAt(newest, look.begin());
    const std::uint64_t begin = look.begin() >> level << level;
    if (end > 0 && before.begin() == begin && before.level() == level) {
      const Packed joined(begin, level, Packed::join(before.words(), look.words()));
      end = last + joined.size;
      std::copy_n(joined.words.begin(), joined.size, words + last);
      continue;
    }
    const std::uint64_t head = look.headAt(begin, level);
    if (end < next) std::copy_n(words + next, size, words + end);
    words[end] = head;
    last = end;
    end += size;
  }
  words_.resize(end);
}

void Looks::add(const Look& look) {
  const Packed::Bits bits = Packed::bitsOf(look);
  if (std::all_of(bits.begin(), bits.end(), [](std::uint64_t word) { return word == 0; })) return;
  if (!empty() && begin()->begin() == look.begin_ && look.level_ == 0) {
    const StoredLook latest = *begin();
    replace(0, latest.size(), Packed(look.begin_, 0, Packed::join(latest.words(), bits)));
    return;
  }
  insert(Packed(look.begin_, look.level_, bits));
  coarsen();
}

void Looks::add(const Looks& other) {
  if (other.empty()) return;
  for (const StoredLook& look : other) insert(Packed(look));
  coarsen();
}

void Looks::append(const Look& look) {
  const bool is_possible = look.begin_ <= Look::tickOf(~std::uint64_t{0}) && look.level_ < kNoLevel;
  replace(0, 0, is_possible ? Packed(look) : Packed(0, kNoLevel, {}));
}

bool Looks::isCanonical() const {
  if (empty()) return true;
  const std::uint64_t newest = begin()->begin();
  std::uint64_t later = newest + 1;
  for (const StoredLook& look : *this) {
    const bool is_latest = later > newest;
    const bool may_be_empty = is_latest && look.size() < words_.size();
    if (look.begin() >= later || look.level() != levelAt(newest, look.begin()) ||
        look.begin() >> look.level() << look.level() != look.begin() || !(look.hasSeen() || may_be_empty)) {
      return false;
    }
    later = look.begin();
  }
  return true;
}

void Looks::erase(const Look::Voxels& voxels) {
  moveVoxels([&](Look::Voxels& mask) { mask &= ~voxels; });
}

void Looks::subtract(Looks other) {
  if (empty() || other.empty()) return;
  other.insert(Packed(begin()->begin(), 0, {}));
  other.coarsen();
  std::vector<Look> looks = all();
  for (const Look& of_other : other.all()) {
    for (Look& look : looks) {
      if (look.begin_ != of_other.begin_ || look.level_ != of_other.level_) continue;
      const Look::Voxels different = (look.low_ ^ of_other.low_) | (look.high_ ^ of_other.high_);
      look.low_ &= different;
      look.high_ &= different;
    }
  }
  keep(looks);
}

void Looks::keep(const std::vector<Look>& looks) {
  words_.clear();
  const auto has_seen = [](const Look& look) { return look.seen().any(); };
  if (std::none_of(looks.begin(), looks.end(), has_seen)) return;
  for (const Look& look : looks) {
    if (has_seen(look) || &look == &looks.back()) replace(0, 0, Packed(look));
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
