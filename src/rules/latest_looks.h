/// @file What the latest looks say of the state of a voxel: Equation 12c in docs/method.md. No rule of the
/// paper.
#pragma once

#include <cstddef>

#include "bki_mapping/map/block.h"
#include "bki_mapping/rules/state_rules.h"
#include "rules/state_kernels.h"

namespace bki_mapping {

/// Number of intervals since the last hit in which a voxel was seen void, from which on it is free.
constexpr int kVoidsToClear = 2;
/// A visit ends where the level of an interval is at least kVisitLevel, and at least kVisitLevels above that
/// of the next one of its block: then nobody looked at the block in between for 2^(kVisitLevel - 2) ticks, 69
/// s, or longer.
constexpr unsigned kVisitLevel = 10, kVisitLevels = 3;
/// Ticks for which beams must have crossed what can move and was last hit in an earlier visit, to clear it.
constexpr std::uint64_t kCrossedToClear = 2;

/// How long a voxel has been hit, by the evidence of its likeliest class.
enum class Stay : std::uint8_t {
  kPassing,  ///< in less than about eight scans
  kSome,
  kLong,  ///< long enough to be there still if nobody has looked since
};
/// @param best evidence of the likeliest class.
inline Stay stayOf(EvidenceUnits best, const StateRules& rules) {
  if (best >= rules.staysFrom()) return Stay::kLong;
  return best >= rules.arrivedStaysFrom() ? Stay::kSome : Stay::kPassing;
}

/// What the looks say of a voxel: kKept, kCleared, or kNotOverruled where the sum decides.
/// @param offset of the voxel in its block. @param can_leave StateRules::canLeave of its likeliest class.
std::int32_t verdictOf(const Looks& looks, std::size_t offset, Stay stay, bool can_leave);

/// The same for all voxels of a block: where looks decide, overwrites what the voxels around say.
/// @return whether they decide anywhere.
bool overruleByLooks(const Block& block, const StateRules& rules, Overruled& overruled);

}  // namespace bki_mapping
