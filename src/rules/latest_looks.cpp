#include "rules/latest_looks.h"

#include <algorithm>

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

/// A voxel since it was last hit.
struct SinceLastHit {
  Fate fate;
  Looks::Iterator hit;        ///< the look, or the end
  std::uint64_t crossed = 0;  ///< at most [ticks]
};
SinceLastHit sinceLastHit(const Looks& looks, std::size_t offset) {
  SinceLastHit since{Fate::kUnclear, looks.begin()};
  int seen = 0, voids = 0;
  for (; since.hit != looks.end(); ++since.hit) {
    const Sight sight = since.hit->at(offset);
    if (sight == Sight::kHit) break;
    if (sight != Sight::kNothing) since.crossed += since.hit->length();
    seen += sight != Sight::kNothing;
    voids += sight == Sight::kVoid;
  }
  if (since.hit == looks.end()) return since;
  if (seen == 0) {
    since.fate = since.hit->level() == 0 ? Fate::kHere : Fate::kHidden;
  } else if (voids >= kVoidsToClear) {
    since.fate = Fate::kLeft;
  } else if (voids == 0 && seen <= kMostGrazed) {
    since.fate = Fate::kGrazed;
  }
  return since;
}

}  // namespace

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

Fate fateOf(const Looks& looks, std::size_t offset) {
  return sinceLastHit(looks, offset).fate;
}

std::int32_t verdictOf(const Looks& looks, std::size_t offset, Stay stay, bool can_leave) {
  const Looks::Iterator end = looks.end();
  const SinceLastHit since = sinceLastHit(looks, offset);
  switch (since.fate) {
    case Fate::kHere:
      return kKept;
    case Fate::kLeft:
      return kCleared;
    case Fate::kHidden: {
      const bool has_stayed =
          stay == Stay::kLong || (stay == Stay::kSome && wasFreeBefore(since.hit, end, offset));
      return has_stayed ? kKept : kNotOverruled;
    }
    case Fate::kGrazed:
    case Fate::kUnclear:
      break;
  }
  const bool is_of_earlier_visit = since.hit != end && visitBefore(looks.begin(), end) <= since.hit;
  return can_leave && is_of_earlier_visit && since.crossed >= kCrossedToClear ? kCleared : kNotOverruled;
}

Fates fatesOf(const Looks& looks) {
  static_assert(kVoidsToClear == 2 && kCrossedToClear == 2 && kMostGrazed == 2, "twice is enough");
  const Looks::Iterator end = looks.end(), visit_before = visitBefore(looks.begin(), end);
  // In the looks so far, up to the last hit:
  Look::Voxels hit, crossed, crossed_twice, seen_twice, seen_thrice, voids, voids_twice;
  Fates fates;
  for (Looks::Iterator at = looks.begin(); at != end; ++at) {
    const Look look = (*at).unpacked();
    const Look::Voxels last_hit = look.hit() & ~hit;
    (look.level() == 0 ? fates.here : fates.hidden) |= last_hit & ~crossed;
    fates.grazed |= last_hit & crossed & ~seen_thrice & ~voids;
    fates.left |= last_hit & voids_twice;
    if (visit_before <= at) fates.crossed |= last_hit & crossed_twice & ~voids_twice;
    hit |= last_hit;
    const Look::Voxels seen = look.seen() & ~hit, is_void = look.voids() & ~hit;
    crossed_twice |= look.length() >= kCrossedToClear ? seen : crossed & seen;
    seen_thrice |= seen_twice & seen;
    seen_twice |= crossed & seen;
    crossed |= seen;
    voids_twice |= voids & is_void;
    voids |= is_void;
  }
  return fates;
}

bool overruleByLooks(const Block& block, const StateRules& rules, const Fates& fates, Overruled& overruled) {
  forEachVoxelOf(fates.here, [&](std::size_t v) { overruled[v] = kKept; });
  forEachVoxelOf(fates.left, [&](std::size_t v) { overruled[v] = kCleared; });
  bool decides = fates.here.any() || fates.left.any();
  const auto overrule = [&](std::size_t v, std::int32_t verdict) {
    overruled[v] = verdict;
    decides = true;
  };
  forEachVoxelOf(fates.hidden, [&](std::size_t v) {
    const Stay stay = stayOf(likeliestClass(block, v).second, rules);
    if (stay == Stay::kLong || (stay == Stay::kSome && verdictOf(block.looks(), v, stay, false) == kKept))
      overrule(v, kKept);
  });
  forEachVoxelOf(fates.crossed, [&](std::size_t v) {
    if (rules.canLeave(likeliestClass(block, v).first)) overrule(v, kCleared);
  });
  return decides;
}

}  // namespace bki_mapping
