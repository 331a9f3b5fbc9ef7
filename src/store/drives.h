/// @file Drives that count once: finds those whose scans would count twice, and chooses what to add.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Consecutive scans of a sequence, by their numbers.
struct ScanRange {
  std::string sequence;
  std::uint64_t first = 0, last = 0;  ///< both included
};

/// The scans that the id of a drive names: "SEQUENCE/FIRST-LAST", as map_sequence makes it, or
/// "SEQUENCE#FIRST+COUNT", as map_city does; nullopt for other ids. COUNT scans without gaps are assumed.
std::optional<ScanRange> scansOf(const std::string& drive_id);

/// The scans that two drives with different ids share: those that both ids name. Drives whose times do not
/// overlap are of different recordings, and share none.
std::optional<ScanRange> sharedScans(const DriveRecord& a, const DriveRecord& b);

/// "scan 000003 of NAME", "scans 000003 to 000007 of NAME".
std::string textOf(const ScanRange& scans);

/// Checks that the scans of drives are not in a map yet. @param where the map, for the sentence.
/// @param allow_overlap refuses only drives whose ids are in the map.
/// @throws std::invalid_argument.
void checkNotAdded(const std::string& where, const std::vector<DriveRecord>& there,
                   const std::vector<DriveRecord>& added, bool allow_overlap = false);

using DriveSet = std::set<std::string>;  ///< ids

bool disjoint(const DriveSet& a, const DriveSet& b);

/// Chooses sets so that each of the drives is in exactly one of them, and no other drive is in any (an exact
/// cover). The choice does not depend on the order of the sets.
/// @param smallest_first prefers many small sets to few large ones.
/// @return positions in `sets`; nullopt if there is no such choice.
std::optional<std::vector<std::size_t>> exactCover(const DriveSet& drives, const std::vector<DriveSet>& sets,
                                                   bool smallest_first);

}  // namespace bki_mapping
