// What the latest looks say of a voxel (12c), by hand and against a slow reading of its definition.
#include "rules/latest_looks.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace bki_mapping {
namespace {

constexpr std::uint64_t kStart = 1 << 20;

/// One letter a tick, the last one the latest: h hit, v void, c crossed, - not seen.
Looks looksOf(const std::string& sights, std::size_t voxel = 0, std::uint64_t start = kStart) {
  Looks looks;
  for (std::size_t n = 0; n < sights.size(); ++n) {
    Look::Voxels crossed, voids, hit;
    crossed[voxel] = sights[n] == 'c';
    voids[voxel] = sights[n] == 'v';
    hit[voxel] = sights[n] == 'h';
    looks.add(Look(start + n, crossed, voids, hit));
  }
  // Scans that see another voxel, so that the block is looked at to the end.
  Look::Voxels other;
  other[kBlockVoxels - 1] = true;
  looks.add(Look(start + sights.size() - 1, other, {}, {}));
  return looks;
}

std::string verdict(const std::string& sights, Stay stay = Stay::kPassing, bool can_leave = true) {
  const std::int32_t verdict = verdictOf(looksOf(sights), 0, stay, can_leave);
  return verdict == kKept ? "occupied" : verdict == kCleared ? "free" : "the sum";
}

TEST(LatestLooks, AHitNowOccupies) {
  EXPECT_EQ(verdict("h"), "occupied");
  EXPECT_EQ(verdict(std::string(4000, 'v') + 'h'), "occupied") << "after 18 minutes of free view";
  EXPECT_EQ(verdict("ccch-"), "occupied") << "the tick before the latest";
}

TEST(LatestLooks, WithoutAnyHitTheSumDecides) {
  EXPECT_EQ(verdict("c"), "the sum");
  EXPECT_EQ(verdict(std::string(50, 'v')), "the sum");
  EXPECT_EQ(verdict("----"), "the sum");
}

TEST(LatestLooks, TwoVoidIntervalsClear) {
  const std::string parked(4000, 'h');
  EXPECT_NE(verdict(parked + "v"), "free") << "one may be an error";
  EXPECT_EQ(verdict(parked + "vv"), "free");
  EXPECT_EQ(verdict(parked + "vcccv"), "free");
  EXPECT_EQ(verdict(parked + "vvh"), "occupied") << "it is back";
}

TEST(LatestLooks, WhereBeamsHaveCrossedSinceTheSumDecides) {
  const std::string parked(200, 'h');  // 54 s
  for (const Stay stay : {Stay::kPassing, Stay::kSome, Stay::kLong}) {
    EXPECT_EQ(verdict(parked + "c", stay), "the sum");
    EXPECT_EQ(verdict(parked + std::string(200, 'c'), stay), "the sum");
    EXPECT_EQ(verdict("hhc", stay), "the sum");
  }
}

TEST(LatestLooks, WhatStayedAndIsNotSeenAgainIsThereStill) {
  const std::string unseen(3000, '-');
  EXPECT_EQ(verdict("hhhhh" + unseen, Stay::kLong), "occupied");
  EXPECT_EQ(verdict("h" + unseen), "the sum") << "a passer-by that is hidden since";
}

// Of 20 minutes, of which the first few are another visit.
TEST(LatestLooks, WhatAnEarlierVisitSawFreeCountsNoMore) {
  const std::string before = "vvvv" + std::string(4000, '-'), after(60, '-');
  EXPECT_EQ(verdict(before + "hhh" + after, Stay::kSome), "occupied") << "parked here today";
  EXPECT_EQ(verdict("cc" + before + "hhh" + after, Stay::kSome), "occupied");
  EXPECT_EQ(verdict(before + "hhh" + after, Stay::kPassing), "the sum") << "a passer-by of today";
  EXPECT_EQ(verdict(before + "hhh--------cc", Stay::kSome), "the sum");
  EXPECT_EQ(verdict("vvvv" + std::string(20, '-') + "hhh" + after, Stay::kSome), "the sum") << "one visit";
  EXPECT_EQ(verdict("hhhh" + before.substr(4) + "hhh" + after, Stay::kSome), "the sum")
      << "it never was free";
}

TEST(LatestLooks, WhatAnEarlierVisitHitIsClearedSooner) {
  const std::string hour(13000, '-');
  for (const Stay stay : {Stay::kPassing, Stay::kSome, Stay::kLong}) {
    EXPECT_EQ(verdict(std::string(300, 'h') + hour + "cc", stay), "free");
    EXPECT_NE(verdict(std::string(300, 'h') + hour + "c", stay), "free") << "a tick may be an error";
  }
  EXPECT_EQ(verdict(std::string(300, 'h') + hour + "hcc", Stay::kSome), "the sum")
      << "hit in this visit, too";
}

/// The definition in docs/method.md, voxel by voxel and look by look.
std::int32_t slowVerdict(const Looks& looks, std::size_t voxel, Stay stay, bool can_leave) {
  const std::vector<Look> all = looks.all();
  std::vector<std::pair<Sight, Look>> seen;  // from the latest
  for (auto look = all.rbegin(); look != all.rend(); ++look) {
    if (look->at(voxel) != Sight::kNothing) seen.emplace_back(look->at(voxel), *look);
  }
  std::size_t last_hit = 0;
  while (last_hit < seen.size() && seen[last_hit].first != Sight::kHit) ++last_hit;
  if (last_hit == seen.size()) return kNotOverruled;
  const Look& hit_look = seen[last_hit].second;
  // The begins of visits, from the latest to the earliest.
  std::vector<std::uint64_t> begins;
  for (std::size_t n = all.size() - 1; n > 0; --n) {
    if (all[n - 1].length() >= 1024 && all[n - 1].length() >= 8 * all[n].length())
      begins.push_back(all[n].begin());
  }
  const auto visit_of = [&](const Look& look) {
    return std::count_if(begins.begin(), begins.end(),
                         [&](std::uint64_t begin) { return look.begin() < begin; });
  };
  bool was_free = false;
  for (const auto& [sight, look] : seen)
    was_free |= sight != Sight::kHit && visit_of(look) > visit_of(hit_look);
  const bool has_stayed = stay == Stay::kLong || (stay == Stay::kSome && was_free);
  if (last_hit == 0) return hit_look.length() == 1 || has_stayed ? kKept : kNotOverruled;
  std::uint64_t crossed = 0, voids = 0;
  for (std::size_t n = 0; n < last_hit; ++n) {
    crossed += seen[n].second.length();
    voids += seen[n].first == Sight::kVoid;
  }
  if (voids >= 2) return kCleared;
  if (can_leave && visit_of(hit_look) > 0 && crossed >= 2) return kCleared;
  return kNotOverruled;
}

TEST(LatestLooks, AreReadForAWholeBlockAsVoxelByVoxel) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    Block block;
    std::uint64_t tick = 1000000;
    const unsigned longest = 1u << random() % 12;
    // Runs, so that long stays occur.
    std::vector<int> sight(kBlockVoxels);
    for (int scans = static_cast<int>(random() % 80); scans > 0; --scans) {
      Look::Voxels crossed, voids, hit;
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        if (random() % 6 == 0) sight[v] = static_cast<int>(random() % 5);
        crossed[v] = sight[v] == 1;
        voids[v] = sight[v] == 2;
        hit[v] = sight[v] >= 3;
      }
      block.looks().add(Look(tick, crossed, voids, hit));
      tick += random() % longest + 1;
      if (random() % 40 == 0) tick += 2048 << random() % 6;  // until the next visit
    }
    std::vector<EvidenceUnits> plane(kBlockVoxels);
    constexpr EvidenceUnits kMost = 200;  // so that a long stay has 2000
    for (const int id : {3, 7, static_cast<int>(kFreeClass)}) {
      for (EvidenceUnits& units : plane)
        units = static_cast<EvidenceUnits>(random() % (round % 2 == 0 ? 2500 : 300));
      block.add(static_cast<ClassId>(id), plane.data());
    }
    const StateRules rules = StateRules()
                                 .withHitOfScan(kMost * kEvidenceUnit / StateRules::kMostVotes)
                                 .withFreeGain(3, 2.0)
                                 .withFreeGain(7, 0.5);
    ASSERT_EQ(rules.mostVote(), kMost);
    Overruled overruled;
    overruled.fill(kNotOverruled);
    const bool any = overruleByLooks(block, rules, fatesOf(block.looks()), overruled);
    bool expected_any = false;
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      const EvidenceUnits best = std::max(block.evidence(3)[v], block.evidence(7)[v]);
      const Stay stay = best >= 10 * kMost ? Stay::kLong : best >= kMost / 2 ? Stay::kSome : Stay::kPassing;
      const bool can_leave = best > 0 && block.evidence(3)[v] == best;
      const std::int32_t expected = slowVerdict(block.looks(), v, stay, can_leave);
      ASSERT_EQ(verdictOf(block.looks(), v, stay, can_leave), expected);
      ASSERT_EQ(overruled[v], expected) << "round " << round << ", voxel " << v;
      expected_any |= expected != kNotOverruled;
    }
    EXPECT_EQ(any, expected_any);
  }
}

}  // namespace
}  // namespace bki_mapping
