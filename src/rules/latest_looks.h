/// @file What the latest looks say of the state of a voxel: Equation 12c in docs/method.md. No rule of the
/// paper.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "bki_mapping/map/block.h"
#include "bki_mapping/rules/state_rules.h"
#include "rules/state_kernels.h"

namespace bki_mapping {

/// Number of intervals since the last hit in which a voxel was seen void, from which on it is free.
constexpr int kVoidsToClear = 2;
/// The most intervals since the last hit in which beams may have crossed a voxel, none of them void, for it
/// to ask what is around it.
constexpr int kMostGrazed = 2;
/// A visit ends where the level of an interval is at least kVisitLevel, and at least kVisitLevels above that
/// of the next one of its block: then nobody looked at the block in between for 2^(kVisitLevel - 2) ticks, 69
/// s, or longer.
constexpr unsigned kVisitLevel = 10, kVisitLevels = 3;
/// Ticks for which beams must have crossed what can move and was last hit in an earlier visit, to clear it.
constexpr std::uint64_t kCrossedToClear = 2;

/// What has become of what was last hit in a voxel, by the looks since.
enum class Fate : std::uint8_t {
  kUnclear,  ///< it was never hit, or none of the others applies
  kHere,     ///< hit in one of the two latest ticks of its block, and not seen since
  kHidden,   ///< hit before them, and not seen since
  kGrazed,   ///< crossed in one or two intervals since, and void in none
  kLeft,     ///< it was void in two intervals since
};
Fate fateOf(const Looks& looks, std::size_t offset);

/// The voxels of a block by their fates.
struct Fates {
  Look::Voxels here, hidden, grazed, left;
  /// Of the unclear and grazed ones, those last hit in an earlier visit, and crossed for kCrossedToClear
  /// since.
  Look::Voxels crossed;
};
Fates fatesOf(const Looks& looks);

/// The class with the most evidence in a voxel, of equal ones that with the smallest id, and its evidence.
std::pair<ClassId, EvidenceUnits> likeliestClass(const Block& block, std::size_t offset);

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
/// @param fates of the block's looks. @return whether they decide anywhere.
bool overruleByLooks(const Block& block, const StateRules& rules, const Fates& fates, Overruled& overruled);

}  // namespace bki_mapping
