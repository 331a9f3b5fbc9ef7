/// @file A stable counting sort.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace bki_mapping {

/// Sorts items by an integer key in linear time; items with the same key keep their order.
/// @param begin array of `keys` + 1 elements. The caller sets begin[0] to 0 and begin[k + 1] to the number of
/// items with key k, which most callers count as they make the items. On return, the items with key k are at
/// positions begin[k] to begin[k + 1] - 1.
/// @param forEachItem called once as forEachItem(positionOf). It must call positionOf(key) for each item in
/// order, and move the item to the position returned.
template <typename ForEachItem>
void groupBy(std::size_t keys, std::uint32_t* begin, ForEachItem&& forEachItem) {
  for (std::size_t k = 1; k <= keys; ++k) begin[k] += begin[k - 1];
  forEachItem([begin](std::size_t key) { return begin[key]++; });
  // Each begin has advanced to that of the next key; shift them back.
  std::copy_backward(begin, begin + keys, begin + keys + 1);
  begin[0] = 0;
}

}  // namespace bki_mapping
