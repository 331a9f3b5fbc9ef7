/// @file When scans looked at the voxels of a block, and what they saw: not what the map sums, but its order
/// in time.
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// What the scans of an interval of time saw of a voxel. The largest of what they saw counts: a hit outweighs
/// what beams of the same interval crossed.
enum class Sight : std::uint8_t {
  kNothing = 0,
  kCrossed = 1,  ///< beams crossed the voxel, and none ended in it
  kVoid = 2,     ///< it and its neighbours were seen empty (Equation 14a in docs/method.md)
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
  void join(const Look& other) {
    const Voxels hit_in_any = hit() | other.hit(), high = high_ | other.high_;
    low_ = hit_in_any | ((low_ | other.low_) & ~high);
    high_ = high;
  }

  std::uint64_t begin_ = 0;
  unsigned level_ = 0;
  Voxels low_, high_;
};

/// The looks at a block: fine intervals for the latest time, coarser ones before. The older an interval, the
/// longer: 2^level ticks, at multiples of its length, with the smallest level at which the interval is the
/// latest one's or the one before. So they depend on nothing but the set of scans: neither on their order nor
/// on how maps were merged. Their number grows with the logarithm of the time.
class Looks {
 public:
  /// By rising time. Each has seen something; the latest alone may not, after erase(), because its time
  /// determines the intervals of the others.
  const std::vector<Look>& all() const { return looks_; }
  bool empty() const { return looks_.empty(); }

  /// Allocates memory for further looks.
  void reserve(std::size_t further) { looks_.reserve(looks_.size() + further); }
  /// Allocates memory for what a scan sees, if its tick is not the latest already.
  void reserveTick(std::uint64_t tick) {
    if (looks_.empty() || looks_.back().begin_ != tick) reserve(1);
  }
  void shrink() noexcept {
    if (looks_.capacity() > looks_.size()) looks_.shrink_to_fit();
  }
  /// Adds what scans of an interval saw; nothing is kept of one that saw nothing. Allocates nothing after
  /// reserve(1).
  void add(const Look& look);
  /// Adds the looks of another map at the same block. Allocates nothing after reserve(other.all().size()).
  void add(const Looks& other);
  /// Adds a look from a file after all others; isCanonical() says whether it may be there.
  void append(const Look& look) { looks_.push_back(look); }
  /// Whether the intervals are those that the latest one demands, and all() holds of them.
  bool isCanonical() const;
  /// Forgets what was seen of some voxels. The rest keeps its intervals as long as any is left.
  void erase(const Look::Voxels& voxels);
  /// Takes out the looks of scans that are among those of this block. What others may have seen as well goes,
  /// too: only the strongest sight of an interval is known.
  void subtract(Looks other);
  /// Moves what was seen to other voxels. @param move called as move(mask), changes a mask.
  template <typename Move>
  void moveVoxels(Move&& move) {
    for (Look& look : looks_) {
      move(look.low_);
      move(look.high_);
    }
    dropEmpty();
  }
  void clear() noexcept { looks_ = {}; }

  bool operator==(const Looks& other) const { return looks_ == other.looks_; }
  std::size_t bytes() const { return looks_.capacity() * sizeof(Look); }

  /// The level of the interval of a tick. @param newest tick, not before it.
  static unsigned levelAt(std::uint64_t newest, std::uint64_t tick) {
    unsigned level = 0;
    while ((newest >> level) - (tick >> level) > 1) ++level;
    return level;
  }

 private:
  void insert(const Look& look);
  /// Drops looks that have seen nothing, except the latest.
  void dropEmpty();
  /// Joins intervals as their ages demand.
  void coarsen();

  std::vector<Look> looks_;
};

/// The looks at some blocks, by their index.
using LooksByBlock = std::unordered_map<GridIndex, Looks, GridIndexHash>;

}  // namespace bki_mapping
