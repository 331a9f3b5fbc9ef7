#include "bki_mapping/map/class_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

using namespace bki_mapping;

namespace {

std::vector<ClassId> idsOf(const ClassList& list) {
  return {list.begin(), list.end()};
}

/// Every second id, so that others can be inserted between them.
ClassList evenOnes(int count) {
  ClassList list;
  for (int n = 0; n < count; ++n) list.insert(list.size(), static_cast<ClassId>(2 * n));
  return list;
}

}  // namespace

TEST(ClassListTest, HoldsWhatASortedVectorHolds) {
  std::mt19937 random(1);
  ClassList list;
  std::vector<ClassId> expected;
  bool had_many = false;
  for (int step = 0; step < 4000; ++step) {
    // It fills up at first, and empties at last.
    const auto id = static_cast<ClassId>(random() % 256);
    const bool fills = random() % 4000 > static_cast<unsigned>(step);
    const auto place = std::lower_bound(expected.begin(), expected.end(), id);
    const std::size_t position = list.positionOf(id);
    ASSERT_EQ(position, static_cast<std::size_t>(place - expected.begin()));
    const bool known = place != expected.end() && *place == id;
    ASSERT_EQ(list.has(id, position), known);
    if (fills && !known && list.size() <= kMaxClasses) {
      list.insert(position, id);
      expected.insert(place, id);
    } else if (!fills && known) {
      list.erase(position);
      expected.erase(place);
    }
    if (step % 7 == 0) list.shrink();
    had_many |= list.bytes() > 0;
    ASSERT_EQ(idsOf(list), expected);
  }
  EXPECT_TRUE(had_many);
  EXPECT_EQ(list.bytes(), 0u) << "few classes are left";
}

TEST(ClassListTest, HoldsAllClasses) {
  ClassList list;
  for (std::size_t n = 0; n < kMaxClasses; ++n) list.insert(n, static_cast<ClassId>(n));
  list.insert(kMaxClasses, kFreeClass);
  EXPECT_EQ(list.size(), kMaxClasses + 1);
  EXPECT_TRUE(list.has(kFreeClass, list.positionOf(kFreeClass)));
}

TEST(ClassListTest, CopiesAndMovesFewAndMany) {
  for (const int count : {0, 3, 15, 16, 100}) {
    const ClassList list = evenOnes(count);
    ClassList copy = list;
    EXPECT_EQ(copy, list);
    const ClassList moved = std::move(copy);
    EXPECT_EQ(moved, list);
    for (const int other : {2, 40}) {
      ClassList assigned = evenOnes(other);
      assigned = list;
      EXPECT_EQ(idsOf(assigned), idsOf(list));
      ClassList taken = evenOnes(other);
      taken = std::move(assigned);
      EXPECT_EQ(idsOf(taken), idsOf(list));
      taken.insert(taken.positionOf(1), 1);
      EXPECT_NE(taken, list);
    }
  }
}

TEST(ClassListTest, AllocatesNothingForAFew) {
  ClassList list = evenOnes(15);
  EXPECT_EQ(list.bytes(), 0u);
  list.insert(15, kFreeClass);
  EXPECT_GT(list.bytes(), 0u);
  list.erase(3);
  list.shrink();
  EXPECT_EQ(list.bytes(), 0u);
  EXPECT_EQ(list[14], kFreeClass);
}
