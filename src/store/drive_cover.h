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

/// Which of the sets have each of the drives in exactly one of them, and no other drive. Depends on the sets,
/// not on their order.
/// @param smallest_first prefers many small sets to few large ones.
/// @return positions in `sets`; nothing if there is no such choice.
std::optional<std::vector<std::size_t>> exactCover(const DriveSet& drives, const std::vector<DriveSet>& sets,
                                                   bool smallest_first);

}  // namespace bki_mapping
