#include "journal/moved_looks.h"

#include <utility>

namespace bki_mapping {
namespace {

std::size_t bytesOf(const LooksByBlock& looks) {
  std::size_t bytes = 0;
  for (const auto& [block, seen] : looks) bytes += sizeof(std::pair<GridIndex, Looks>) + seen.bytes();
  return bytes;
}

}  // namespace

void MovedLooks::drop(Number scan, const std::vector<GridIndex>& regions) {
  for (const GridIndex& region : regions) {
    const auto found = regions_.find(region);
    if (found != regions_.end() && found->second.scans.count(scan) > 0) take(region);
  }
}

void MovedLooks::add(LooksByRegion looks, const std::vector<Number>& scans,
                     const std::vector<std::vector<GridIndex>>& regions) {
  if (bytes_ / 2 >= most_bytes_) return;
  for (std::size_t n = 0; n < scans.size(); ++n) {
    for (const GridIndex& region : regions[n]) {
      if (bytes_ < most_bytes_ || regions_.count(region) > 0) regions_[region].scans.insert(scans[n]);
    }
  }
  for (auto& [region, blocks] : looks) {
    const auto found = regions_.find(region);
    if (found == regions_.end()) continue;
    LooksByBlock& known = found->second.looks;
    bytes_ -= bytesOf(known);
    for (auto& [block, seen] : blocks) known[block].add(seen);
    bytes_ += bytesOf(known);
  }
}

MovedLooks::OfRegion MovedLooks::take(const GridIndex& region) {
  const auto found = regions_.find(region);
  if (found == regions_.end()) return {};
  OfRegion taken = std::move(found->second);
  regions_.erase(found);
  bytes_ -= bytesOf(taken.looks);
  return taken;
}

void MovedLooks::clear() {
  regions_.clear();
  bytes_ = 0;
}

}  // namespace bki_mapping
