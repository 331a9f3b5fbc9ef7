/// @file The looks of scans that have moved, so that these need not be looked through again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "journal/scan_mover.h"

namespace bki_mapping {

/// For some regions, the looks of those scans that have moved there, at the poses where they are now. Not
/// thread-safe.
class MovedLooks {
 public:
  using Number = std::uint64_t;
  struct OfRegion {
    LooksByBlock looks;
    std::set<Number> scans;  ///< whose looks these are: all that they have in the region
  };

  static constexpr std::size_t kMostBytes = 256 << 20;
  /// @param bytes limit: once the looks take as much, those of other regions are left out, and at twice the
  /// limit those of all. 0 keeps none.
  explicit MovedLooks(std::size_t bytes = kMostBytes) : most_bytes_(bytes) {}

  /// Forgets the regions with looks of a scan, which is about to leave them. @param regions that it touches.
  void drop(Number scan, const std::vector<GridIndex>& regions);
  /// Adds the looks of scans that have moved together. @param regions that each of them touches now.
  void add(LooksByRegion looks, const std::vector<Number>& scans,
           const std::vector<std::vector<GridIndex>>& regions);
  /// Takes out what is known of a region; nothing, if that is unknown.
  OfRegion take(const GridIndex& region);
  void clear();

  std::size_t bytes() const { return bytes_; }  ///< of the looks; their containers take a tenth more

 private:
  std::size_t most_bytes_, bytes_ = 0;
  std::map<GridIndex, OfRegion> regions_;
};

}  // namespace bki_mapping
