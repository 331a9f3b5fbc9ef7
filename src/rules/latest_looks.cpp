#include "rules/latest_looks.h"

#include <algorithm>
#include <utility>

#include "map/voxel_mask.h"

namespace bki_mapping {
namespace {

using LatestFirst = std::vector<Look>::const_reverse_iterator;

/// The latest look of the visit before that of a look, or the end.
LatestFirst visitBefore(LatestFirst look, LatestFirst end) {
  for (; look != end; ++look) {
    const LatestFirst before = look + 1;
    if (before != end && before->level() >= kVisitLevel && before->level() >= look->level() + kVisitLevels)
      return before;
  }
  return end;
}

/// Whether an earlier visit saw the voxel without a hit, so that its evidence for free is out of date.
bool wasFreeBefore(LatestFirst hit, LatestFirst end, std::size_t offset) {
  return std::any_of(visitBefore(hit, end), end, [&](const Look& look) {
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
  const auto& all = looks.all();
  std::uint64_t crossed = 0;  // since the last hit, at most [ticks]
  int voids = 0;
  auto look = all.rbegin();
  for (; look != all.rend() && look->at(offset) != Sight::kHit; ++look) {
    const Sight sight = look->at(offset);
    if (sight != Sight::kNothing) crossed += look->length();
    voids += sight == Sight::kVoid;
  }
  if (look == all.rend()) return kNotOverruled;
  if (crossed == 0) {
    const bool has_stayed =
        stay == Stay::kLong || (stay == Stay::kSome && wasFreeBefore(look, all.rend(), offset));
    return look->level() == 0 || has_stayed ? kKept : kNotOverruled;
  }
  if (voids >= kVoidsToClear) return kCleared;
  if (can_leave && crossed >= kCrossedToClear && visitBefore(all.rbegin(), all.rend()) <= look)
    return kCleared;
  return kNotOverruled;
}

bool overruleByLooks(const Block& block, const StateRules& rules, Overruled& overruled) {
  const auto& all = block.looks().all();
  Look::Voxels ever_hit, just_hit;
  for (const Look& look : all) ever_hit |= look.hit();
  if (ever_hit.none()) return false;
  Look::Voxels undecided = ever_hit;
  for (auto look = all.rbegin(); look != all.rend() && undecided.any(); ++look) {
    if (look->level() == 0) just_hit |= undecided & look->hit();
    undecided &= ~look->seen();
  }
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
