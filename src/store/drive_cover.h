/// @file Chooses what to add so that each drive counts once.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace bki_mapping {

using DriveSet = std::set<std::string>;  ///< ids

bool disjoint(const DriveSet& a, const DriveSet& b);

/// Chooses sets so that each of the drives is in exactly one of them, and no other drive is in any (an exact
/// cover). The choice does not depend on the order of the sets.
/// @param smallest_first prefers many small sets to few large ones.
/// @return positions in `sets`; nullopt if there is no such choice.
std::optional<std::vector<std::size_t>> exactCover(const DriveSet& drives, const std::vector<DriveSet>& sets,
                                                   bool smallest_first);

}  // namespace bki_mapping
