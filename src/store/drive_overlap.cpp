#include "store/drive_overlap.h"

#include <algorithm>
#include <charconv>
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

}  // namespace bki_mapping
