#include "rules/latest_looks.h"

#include <algorithm>
#include <array>

namespace bki_mapping {

std::int32_t verdictOf(const Looks& looks, std::size_t offset, bool has_stayed) {
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
  if (crossed == 0) return look->level() == 0 || has_stayed ? kKept : kNotOverruled;
  if (voids >= kVoidsToClear) return kCleared;
  if (!has_stayed) return kNotOverruled;
  // Hits at the ends of a run may have been at the ends of their intervals: those between count, and a tick.
  std::uint64_t hits = 1, last = 0;
  int intervals = 0;
  for (; look != all.rend() && look->at(offset) != Sight::kVoid; ++look) {
    if (look->at(offset) != Sight::kHit) continue;
    if (++intervals > 2) hits += last;
    last = look->length();
  }
  return hits >= kHitsOverCrossed * crossed ? kKept : kNotOverruled;
}

bool overruleByLooks(const Block& block, EvidenceUnits most_vote, Overruled& overruled) {
  const auto& all = block.looks().all();
  Look::Voxels ever_hit, just_hit;
  for (const Look& look : all) ever_hit |= look.hit();
  if (ever_hit.none()) return false;
  Look::Voxels undecided = ever_hit;
  for (auto look = all.rbegin(); look != all.rend() && undecided.any(); ++look) {
    if (look->level() == 0) just_hit |= undecided & look->hit();
    undecided &= ~look->seen();
  }
  std::array<EvidenceUnits, kBlockVoxels> best{};  // of any class
  for (std::size_t p = 0; p < block.classes().size(); ++p) {
    if (block.classes()[p] == kFreeClass) continue;
    const EvidenceUnits* const plane = block.plane(p);
    for (std::size_t v = 0; v < kBlockVoxels; ++v) best[v] = std::max(best[v], plane[v]);
  }
  bool decides = false;
  for (std::size_t v = 0; v < overruled.size(); ++v) {
    if (!ever_hit[v]) continue;
    const std::int32_t verdict =
        just_hit[v] ? kKept : verdictOf(block.looks(), v, best[v] >= kStay * most_vote);
    if (verdict == kNotOverruled) continue;
    overruled[v] = verdict;
    decides = true;
  }
  return decides;
}

}  // namespace bki_mapping
