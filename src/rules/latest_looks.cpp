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
  const Looks& looks = block.looks();
  const Looks::Iterator end = looks.end(), visit_before = visitBefore(looks.begin(), end);
  Look::Voxels hit, crossed, crossed_twice, voids, voids_twice;  // in the looks so far, up to the last hit
  Look::Voxels kept, cleared, may_have_stayed, may_leave;
  for (Looks::Iterator at = looks.begin(); at != end; ++at) {
    const Look look = (*at).unpacked();
    const Look::Voxels last_hit = look.hit() & ~hit, never_crossed = last_hit & ~crossed;
    (look.level() == 0 ? kept : may_have_stayed) |= never_crossed;
    cleared |= last_hit & voids_twice;
    if (visit_before <= at) may_leave |= last_hit & crossed_twice & ~voids_twice;
    hit |= last_hit;
    const Look::Voxels seen = look.seen() & ~hit, is_void = look.voids() & ~hit;
    crossed_twice |= look.length() >= kCrossedToClear ? seen : crossed & seen;
    crossed |= seen;
    voids_twice |= voids & is_void;
    voids |= is_void;
  }
  static_assert(kVoidsToClear == 2 && kCrossedToClear == 2, "twice is enough");
  const auto forEachOf = [](const Look::Voxels& voxels, const auto& visit) {
    const LayerBits bits = bitsOf(voxels);
    for (std::size_t layer = 0; layer < bits.size(); ++layer) {
      for (std::uint64_t left = bits[layer]; left != 0; left &= left - 1) {
        visit(64 * layer + static_cast<std::size_t>(__builtin_ctzll(left)));
      }
    }
  };
  forEachOf(kept, [&](std::size_t v) { overruled[v] = kKept; });
  forEachOf(cleared, [&](std::size_t v) { overruled[v] = kCleared; });
  bool decides = kept.any() || cleared.any();
  const auto overrule = [&](std::size_t v, std::int32_t verdict) {
    overruled[v] = verdict;
    decides = true;
  };
  forEachOf(may_have_stayed, [&](std::size_t v) {
    const Stay stay = stayOf(likeliestClass(block, v).second, rules);
    if (stay == Stay::kLong || (stay == Stay::kSome && verdictOf(looks, v, stay, false) == kKept))
      overrule(v, kKept);
  });
  forEachOf(may_leave, [&](std::size_t v) {
    if (rules.canLeave(likeliestClass(block, v).first)) overrule(v, kCleared);
  });
  return decides;
}

}  // namespace bki_mapping
