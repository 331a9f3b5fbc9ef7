// The counting sort against std::stable_sort.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "parallel/group_by.h"

namespace bki_mapping {
namespace {

using Item = std::pair<std::uint32_t, std::size_t>;  // key, position in the input

TEST(GroupBy, SortsAsStableSortDoes) {
  std::mt19937 random(1);
  for (const std::size_t keys : {1u, 2u, 7u, 300u}) {
    for (const std::size_t count : {0u, 1u, 5u, 1000u}) {
      std::uniform_int_distribution<std::uint32_t> anyKey(0, static_cast<std::uint32_t>(keys - 1));
      std::vector<Item> items(count), sorted(count);
      std::vector<std::uint32_t> begin(keys + 1, 0);
      for (std::size_t i = 0; i < count; ++i) {
        items[i] = {anyKey(random), i};
        ++begin[items[i].first + 1];
      }
      groupBy(keys, begin.data(), [&](auto&& positionOf) {
        for (const Item& item : items) sorted[positionOf(item.first)] = item;
      });
      std::vector<Item> expected = items;
      std::stable_sort(expected.begin(), expected.end(),
                       [](const Item& a, const Item& b) { return a.first < b.first; });
      EXPECT_EQ(sorted, expected);
      EXPECT_EQ(begin.front(), 0u);
      EXPECT_EQ(begin.back(), count);
      for (std::size_t k = 0; k < keys; ++k) {
        for (std::uint32_t n = begin[k]; n < begin[k + 1]; ++n) EXPECT_EQ(sorted[n].first, k);
      }
    }
  }
}

}  // namespace
}  // namespace bki_mapping
