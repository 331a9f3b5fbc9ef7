#include "rules/latest_looks.h"

#include <algorithm>
#include <utility>

#include "map/voxel_mask.h"

namespace bki_mapping {
namespace {

/// The latest look of the visit before that of a look, or the end.
Looks::Iterator visitBefore(Looks::Iterator look, Looks::Iterator end) {
  while (look != end) {
    const unsigned level = look->level();
    ++look;
    if (look != end && look->level() >= kVisitLevel && look->level() >= level + kVisitLevels) return look;
  }
  return end;
}

/// Whether an earlier visit saw the voxel without a hit, so that its evidence for free is out of date.
bool wasFreeBefore(Looks::Iterator hit, Looks::Iterator end, std::size_t offset) {
  return std::any_of(visitBefore(hit, end), end, [&](const StoredLook& look) {
    const Sight sight = look.at(offset);
    return sight == Sight::kCrossed || sight == Sight::kVoid;
  });
}

/// The class with the most evidence in a voxel, of equal ones that with the smallest id, and its evidence.
std::pair<ClassId, EvidenceUnits> likeliestClass(const Block& block, std::size_t offset) {
  std::pair<ClassId, EvidenceUnits> likeliest{kFreeClass, 0};
  for (std::size_t p = 0; p < block.classes().size(); ++p) {
    const ClassId id = block.classes()[p];
    const EvidenceUnits units = id == kFreeClass ? 0 : block.plane(p)[offset];
    const bool wins = units > likeliest.second || (units == likeliest.second && id < likeliest.first);
    if (units > 0 && wins) likeliest = {id, units};
  }
  return likeliest;
}

}  // namespace

std::int32_t verdictOf(const Looks& looks, std::size_t offset, Stay stay, bool can_leave) {
  const Looks::Iterator end = looks.end();
  std::uint64_t crossed = 0;  // since the last hit, at most [ticks]
  int voids = 0;
  Looks::Iterator look = looks.begin();
  for (; look != end; ++look) {
    const Sight sight = look->at(offset);
    if (sight == Sight::kHit) break;
    if (sight != Sight::kNothing) crossed += look->length();
    voids += sight == Sight::kVoid;
  }
  if (look == end) return kNotOverruled;
  if (crossed == 0) {
    const bool has_stayed = stay == Stay::kLong || (stay == Stay::kSome && wasFreeBefore(look, end, offset));
    return look->level() == 0 || has_stayed ? kKept : kNotOverruled;
  }
  if (voids >= kVoidsToClear) return kCleared;
  if (can_leave && crossed >= kCrossedToClear && visitBefore(looks.begin(), end) <= look) return kCleared;
  return kNotOverruled;
}

bool overruleByLooks(const Block& block, const StateRules& rules, Overruled& overruled) {
  Look::Voxels ever_hit, just_hit, seen;
  for (const StoredLook& stored : block.looks()) {
    const Look look = stored.unpacked();
    ever_hit |= look.hit();
    if (look.level() == 0) just_hit |= look.hit() & ~seen;
    seen |= look.seen();
  }
  if (ever_hit.none()) return false;
  bool decides = false;
  const LayerBits hit = bitsOf(ever_hit);
  for (std::size_t layer = 0; layer < hit.size(); ++layer) {
    for (std::uint64_t left = hit[layer]; left != 0; left &= left - 1) {
      const std::size_t v = 64 * layer + static_cast<std::size_t>(__builtin_ctzll(left));
      std::int32_t verdict = kKept;
      if (!just_hit[v]) {
        const auto [label, best] = likeliestClass(block, v);
        verdict = verdictOf(block.looks(), v, stayOf(best, rules.mostVote()), rules.canLeave(label));
      }
      if (verdict == kNotOverruled) continue;
      overruled[v] = verdict;
      decides = true;
    }
  }
  return decides;
}

}  // namespace bki_mapping
