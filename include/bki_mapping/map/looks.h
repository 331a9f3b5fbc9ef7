/// @file When scans looked at the voxels of a block, and what they saw: not what the map sums, but its order
/// in time.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <unordered_map>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// What the scans of an interval of time saw of a voxel. The largest of what they saw counts: a hit outweighs
/// what beams of the same interval crossed.
enum class Sight : std::uint8_t {
  kNothing = 0,
  kCrossed = 1,  ///< beams crossed the voxel, and none ended in it
  kVoid = 2,     ///< it and what is around it was seen empty (Equation 14a in docs/method.md)
  kHit = 3,      ///< a beam ended in it
};

/// What the scans of one interval saw of the voxels of a block.
class Look {
 public:
  using Voxels = std::bitset<kBlockVoxels>;  ///< one bit for each voxel, by GridGeometry::offsetInBlock

  /// Intervals are whole multiples of 2^28 ns, 0.27 s.
  static constexpr unsigned kTickBits = 28;
  static constexpr std::uint64_t tickOf(std::uint64_t stamp) { return stamp >> kTickBits; }

  Look() = default;
  /// @param tick in which the scan was taken. @param voids, crossed, hit may share voxels; the strongest
  /// sight counts.
  Look(std::uint64_t tick, const Voxels& crossed, const Voxels& voids, const Voxels& hit)
      : begin_(tick), low_(hit | (crossed & ~voids)), high_(hit | voids) {}
  /// A look from a file. @param begin a multiple of 2^level [ticks].
  Look(std::uint64_t begin, unsigned level, const Voxels& low, const Voxels& high)
      : begin_(begin), level_(level), low_(low), high_(high) {}

  std::uint64_t begin() const { return begin_; }  ///< [ticks]
  unsigned level() const { return level_; }
  std::uint64_t length() const { return std::uint64_t{1} << level_; }  ///< [ticks]

  Voxels hit() const { return low_ & high_; }
  Voxels voids() const { return high_ & ~low_; }
  Voxels crossed() const { return low_ & ~high_; }
  Voxels seen() const { return low_ | high_; }
  Sight at(std::size_t offset) const { return static_cast<Sight>(low_[offset] + 2 * high_[offset]); }
  /// The bits of Sight.
  const Voxels& low() const { return low_; }
  const Voxels& high() const { return high_; }

  bool operator==(const Look& other) const {
    return begin_ == other.begin_ && level_ == other.level_ && low_ == other.low_ && high_ == other.high_;
  }

 private:
  friend class Looks;

  std::uint64_t begin_ = 0;
  unsigned level_ = 0;
  Voxels low_, high_;
};

/// A look as a map stores it: a head, and the words that are not 0. A word has one of the bits of Sight for
/// each voxel of a layer along z. Two in three are 0, because few beams reach into a block in an interval.
class StoredLook {
 public:
  explicit StoredLook(const std::uint64_t* head) : head_(head) {}

  std::uint64_t begin() const { return *head_ >> Look::kTickBits; }  ///< [ticks]
  unsigned level() const { return static_cast<unsigned>(*head_ >> kLevelShift & 63); }
  std::uint64_t length() const { return std::uint64_t{1} << level(); }  ///< [ticks]
  bool hasSeen() const { return (*head_ & kPresent) != 0; }
  Sight at(std::size_t offset) const {
    const std::size_t layer = offset / kLayerVoxels, bit = offset % kLayerVoxels;
    return static_cast<Sight>((wordOf(layer) >> bit & 1) + 2 * (wordOf(kBlockEdge + layer) >> bit & 1));
  }
  Look unpacked() const;

 private:
  friend class Looks;
  /// The low bits of all layers, then the high ones.
  using Words = std::array<std::uint64_t, 2 * kBlockEdge>;
  static constexpr std::size_t kLayerVoxels = kBlockEdge * kBlockEdge;
  static constexpr std::size_t kMostWords = 1 + 2 * kBlockEdge;  ///< with the head
  // The head is the stamp at which the look begins; its bits below a tick are the number of words that
  // follow, the level, and a bit for each of Words that says whether it follows.
  static constexpr unsigned kCountShift = 22, kLevelShift = 16;
  static constexpr std::uint64_t kPresent = 0xffff;

  std::size_t size() const { return 1 + (*head_ >> kCountShift & 31); }  ///< [words], with the head
  Words words() const;
  /// The head of a look that has seen the same at another time.
  std::uint64_t headAt(std::uint64_t begin, unsigned level) const {
    constexpr std::uint64_t kRest = kPresent | std::uint64_t{31} << kCountShift;
    return begin << Look::kTickBits | std::uint64_t{level} << kLevelShift | (*head_ & kRest);
  }
  std::uint64_t wordOf(std::size_t n) const {
    const std::uint64_t bit = std::uint64_t{1} << n;
    if ((*head_ & bit) == 0) return 0;
    return head_[1 + __builtin_popcountll(*head_ & kPresent & (bit - 1))];
  }

  const std::uint64_t* head_;
};

/// The looks at a block: fine intervals for the latest time, coarser ones before. The older an interval, the
/// longer: 2^level ticks, at multiples of its length, with the smallest level at which the interval is the
/// latest one's or the one before. So they depend on nothing but the set of scans: neither on their order nor
/// on how maps were merged. Their number grows with the logarithm of the time. Each has seen something; the
/// latest alone may not, after erase(), because its time determines the intervals of the others.
class Looks {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = StoredLook;
    using difference_type = std::ptrdiff_t;
    using pointer = const StoredLook*;
    using reference = const StoredLook&;

    explicit Iterator(const std::uint64_t* head) : look_(head) {}
    reference operator*() const { return look_; }
    pointer operator->() const { return &look_; }
    Iterator& operator++() {
      look_ = StoredLook(look_.head_ + look_.size());
      return *this;
    }
    bool operator==(const Iterator& other) const { return look_.head_ == other.look_.head_; }
    bool operator!=(const Iterator& other) const { return look_.head_ != other.look_.head_; }
    bool operator<=(const Iterator& other) const { return look_.head_ <= other.look_.head_; }

   private:
    StoredLook look_;
  };

  /// The latest look comes first.
  Iterator begin() const { return Iterator(words_.data()); }
  Iterator end() const { return Iterator(words_.data() + words_.size()); }
  bool empty() const { return words_.empty(); }
  std::size_t size() const { return static_cast<std::size_t>(std::distance(begin(), end())); }
  /// Copies of all looks, by rising time.
  std::vector<Look> all() const;

  /// Allocates memory for further looks.
  void reserve(std::size_t further) { words_.reserve(words_.size() + further * StoredLook::kMostWords); }
  /// Allocates memory for the looks of another map.
  void reserve(const Looks& other) { words_.reserve(words_.size() + other.words_.size()); }
  /// Allocates memory for what a scan sees. Returns what many looks took before they were joined.
  void reserveTick(std::uint64_t tick);
  void shrink() noexcept {
    if (words_.capacity() > words_.size()) words_.shrink_to_fit();
  }
  /// Adds what scans of an interval saw; nothing is kept of one that saw nothing. Allocates nothing after
  /// reserve(1).
  void add(const Look& look);
  /// Adds the looks of another map at the same block. Allocates nothing after reserve(other).
  void add(const Looks& other);
  /// Adds a look from a file after all others; isCanonical() says whether it may be there.
  void append(const Look& look);
  /// Whether the intervals are those that the latest one demands, and have seen what they must.
  bool isCanonical() const;
  /// Forgets what was seen of some voxels. The rest keeps its intervals as long as any is left.
  void erase(const Look::Voxels& voxels);
  /// Takes out the looks of scans that are among those of this block. What others may have seen as well goes,
  /// too: only the strongest sight of an interval is known.
  void subtract(Looks other);
  /// Moves what was seen to other voxels. @param move called as move(mask), changes a mask.
  template <typename Move>
  void moveVoxels(Move&& move) {
    std::vector<Look> looks = all();
    for (Look& look : looks) {
      move(look.low_);
      move(look.high_);
    }
    keep(looks);
  }
  void clear() noexcept { words_.clear(); }

  /// Prefetches the latest look for writing.
  void prefetch() const {
    constexpr std::size_t kLine = 64 / sizeof(std::uint64_t);
    const std::size_t end = std::min(words_.size(), StoredLook::kMostWords);
    for (std::size_t n = 0; n < end; n += kLine) __builtin_prefetch(words_.data() + n, 1);
  }

  bool operator==(const Looks& other) const { return words_ == other.words_; }
  std::size_t bytes() const { return words_.capacity() * sizeof(std::uint64_t); }

  /// The level of the interval of a tick. @param newest tick, not before it.
  static unsigned levelAt(std::uint64_t newest, std::uint64_t tick) {
    unsigned level = 0;
    while ((newest >> level) - (tick >> level) > 1) ++level;
    return level;
  }

 private:
  struct Packed;

  /// Replaces `count` words from a position on.
  void replace(std::size_t position, std::size_t count, const Packed& look);
  void insert(const Packed& look);
  /// Keeps looks, given by rising time, that have seen something, and the latest if any has.
  void keep(const std::vector<Look>& looks);
  /// Joins intervals as their ages demand.
  void coarsen();

  std::vector<std::uint64_t> words_;  ///< of all looks, the latest first
};

/// The looks at some blocks, by their index.
using LooksByBlock = std::unordered_map<GridIndex, Looks, GridIndexHash>;

}  // namespace bki_mapping
