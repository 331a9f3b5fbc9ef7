#include "journal/moved_looks.h"

#include <gtest/gtest.h>

namespace bki_mapping {
namespace {

const GridIndex kHere{0, 0, 0}, kThere{1, 0, 0}, kElsewhere{2, 0, 0};

/// A region with one look at each of some blocks.
LooksByRegion looksAt(const GridIndex& region, std::uint64_t tick, int blocks = 10) {
  LooksByRegion looks;
  for (int n = 0; n < blocks; ++n) {
    looks[region][{8 * region.x + n, 0, 0}].add(Look(tick, Look::Voxels().set(7), {}, {}));
  }
  return looks;
}

TEST(MovedLooks, AddsTheLooksOfEachScanOfARegion) {
  MovedLooks looks;
  looks.add(looksAt(kHere, 5), {1, 2}, {{kHere}, {kHere, kThere}});
  looks.add(looksAt(kHere, 9), {3}, {{kHere}});
  MovedLooks::OfRegion here = looks.take(kHere);
  EXPECT_EQ(here.scans, (std::set<MovedLooks::Number>{1, 2, 3}));
  ASSERT_EQ(here.looks.size(), 10u);
  Looks both;
  both.add(Look(5, Look::Voxels().set(7), {}, {}));
  both.add(Look(9, Look::Voxels().set(7), {}, {}));
  EXPECT_TRUE(here.looks.begin()->second == both);
  EXPECT_EQ(looks.take(kThere).scans, (std::set<MovedLooks::Number>{2}));  // it saw nothing there
  EXPECT_TRUE(looks.take(kHere).scans.empty());
  EXPECT_EQ(looks.bytes(), 0u);
}

TEST(MovedLooks, ForgetsTheRegionsThatAScanLeaves) {
  MovedLooks looks;
  looks.add(looksAt(kHere, 5), {1}, {{kHere}});
  looks.add(looksAt(kThere, 5), {2}, {{kThere}});
  looks.drop(2, {kHere, kThere});
  EXPECT_EQ(looks.take(kHere).scans.size(), 1u);
  EXPECT_TRUE(looks.take(kThere).scans.empty());
  EXPECT_EQ(looks.bytes(), 0u);
}

/// Whatever is known of a region has all looks of the scans that it names.
TEST(MovedLooks, TakesNoOtherRegionsAtTheLimitAndNoLooksAtTwiceTheLimit) {
  MovedLooks one;
  one.add(looksAt(kHere, 5), {1}, {{kHere}});
  MovedLooks looks(one.bytes());
  looks.add(looksAt(kHere, 5), {1}, {{kHere}});
  EXPECT_EQ(looks.bytes(), one.bytes());
  looks.add(looksAt(kThere, 5), {2}, {{kHere, kThere}});  // is full
  EXPECT_EQ(looks.bytes(), one.bytes());
  looks.add(looksAt(kHere, 1000, 20), {3}, {{kHere}});  // of a known region
  EXPECT_GE(looks.bytes(), 2 * one.bytes());
  const std::size_t most = looks.bytes();
  looks.add(looksAt(kHere, 2000), {4}, {{kHere}});  // is twice as full
  EXPECT_EQ(looks.bytes(), most);
  const MovedLooks::OfRegion here = looks.take(kHere);
  EXPECT_EQ(here.scans, (std::set<MovedLooks::Number>{1, 2, 3}));
  EXPECT_EQ(here.looks.size(), 20u);
  EXPECT_TRUE(looks.take(kThere).scans.empty());
  looks.add(looksAt(kElsewhere, 5), {5}, {{kElsewhere}});  // has room again
  EXPECT_EQ(looks.take(kElsewhere).scans.size(), 1u);
}

TEST(MovedLooks, KeepsNoneWithoutMemory) {
  MovedLooks looks(0);
  looks.add(looksAt(kHere, 5), {1}, {{kHere}});
  EXPECT_TRUE(looks.take(kHere).scans.empty());
  EXPECT_EQ(looks.bytes(), 0u);
}

}  // namespace
}  // namespace bki_mapping
