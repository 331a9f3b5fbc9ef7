#include "store/drives.h"

#include <algorithm>
#include <charconv>
#include <numeric>
#include <stdexcept>
#include <string_view>

#include "core/counted.h"

namespace bki_mapping {
namespace {

std::optional<std::uint64_t> numberIn(std::string_view digits) {
  std::uint64_t number = 0;
  const char* const end = digits.data() + digits.size();
  const auto [rest, error] = std::from_chars(digits.data(), end, number);
  if (error != std::errc() || rest != end) return std::nullopt;
  return number;
}

bool timesOverlap(const DriveRecord& a, const DriveRecord& b) {
  return a.scans > 0 && b.scans > 0 && a.first_stamp <= b.last_stamp && b.first_stamp <= a.last_stamp;
}

/// Searches for an exact cover: takes the first drive that is not yet covered, and tries each set that
/// contains it.
class Search {
 public:
  Search(const std::vector<DriveSet>& sets, std::vector<std::size_t> order)
      : sets_(sets), order_(std::move(order)) {}

  bool cover(const DriveSet& left) {
    if (left.empty()) return true;
    for (const std::size_t position : order_) {
      const DriveSet& set = sets_[position];
      if (set.count(*left.begin()) == 0 || !std::includes(left.begin(), left.end(), set.begin(), set.end())) {
        continue;
      }
      DriveSet rest;
      std::set_difference(left.begin(), left.end(), set.begin(), set.end(), std::inserter(rest, rest.end()));
      chosen_.push_back(position);
      if (cover(rest)) return true;
      chosen_.pop_back();
    }
    return false;
  }
  const std::vector<std::size_t>& chosen() const { return chosen_; }

 private:
  const std::vector<DriveSet>& sets_;
  std::vector<std::size_t> order_, chosen_;
};

}  // namespace

std::optional<ScanRange> scansOf(const std::string& drive_id) {
  const std::size_t mark = drive_id.find_last_of("/#");
  if (mark == std::string::npos) return std::nullopt;
  const bool counts = drive_id[mark] == '#';
  const std::string_view numbers = std::string_view(drive_id).substr(mark + 1);
  const std::size_t middle = numbers.find(counts ? '+' : '-');
  if (middle == std::string_view::npos) return std::nullopt;
  const auto first = numberIn(numbers.substr(0, middle)), second = numberIn(numbers.substr(middle + 1));
  if (!first || !second) return std::nullopt;
  if (counts && *second == 0) return std::nullopt;
  const std::uint64_t last = counts ? *first + (*second - 1) : *second;
  if (last < *first) return std::nullopt;
  return ScanRange{drive_id.substr(0, mark), *first, last};
}

std::optional<ScanRange> sharedScans(const DriveRecord& a, const DriveRecord& b) {
  const auto of_a = scansOf(a.id), of_b = scansOf(b.id);
  if (!of_a || !of_b || of_a->sequence != of_b->sequence || !timesOverlap(a, b)) return std::nullopt;
  const ScanRange shared{of_a->sequence, std::max(of_a->first, of_b->first),
                         std::min(of_a->last, of_b->last)};
  if (shared.first > shared.last) return std::nullopt;
  return shared;
}

std::string textOf(const ScanRange& scans) {
  const std::string first = sixDigits(scans.first), of = " of " + scans.sequence;
  return scans.first == scans.last ? "scan " + first + of
                                   : "scans " + first + " to " + sixDigits(scans.last) + of;
}

void checkNotAdded(const std::string& where, const std::vector<DriveRecord>& there,
                   const std::vector<DriveRecord>& added, bool allow_overlap) {
  for (const DriveRecord& known : there) {
    for (const DriveRecord& drive : added) {
      if (known.id == drive.id) {
        throw std::invalid_argument(where + " already holds drive '" + drive.id +
                                    "', which would count twice");
      }
      const auto shared = allow_overlap ? std::nullopt : sharedScans(known, drive);
      if (!shared) continue;
      throw std::invalid_argument(
          "by their ids, drive '" + known.id + "' in " + where + " and drive '" + drive.id + "' share " +
          textOf(*shared) +
          ", which would count twice; add a map without them, or, if they are "
          "different scans, allow the overlap (allow_overlap; --allow-overlap of merge_maps)");
    }
  }
}

bool disjoint(const DriveSet& a, const DriveSet& b) {
  return std::none_of(a.begin(), a.end(), [&](const std::string& id) { return b.count(id) > 0; });
}

std::optional<std::vector<std::size_t>> exactCover(const DriveSet& drives, const std::vector<DriveSet>& sets,
                                                   bool smallest_first) {
  std::vector<std::size_t> order(sets.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (sets[a].size() != sets[b].size()) return (sets[a].size() < sets[b].size()) == smallest_first;
    return sets[a] < sets[b];
  });
  Search search(sets, std::move(order));
  if (!search.cover(drives)) return std::nullopt;
  return search.chosen();
}

}  // namespace bki_mapping
