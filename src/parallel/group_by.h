/// @file A stable counting sort.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace bki_mapping {

/// Groups items by a key, in linear time; items of one key keep their order.
/// @param begin `keys` + 1 numbers. The caller sets begin[0] to 0 and begin[k + 1] to the number of items
/// with key k, which it mostly counts while it makes them. On return, the items of key k stand from begin[k]
/// to before begin[k + 1].
/// @param forEachItem called once as forEachItem(positionOf): it calls positionOf(key) for each item, in
/// order, and moves the item to the position that it gets.
template <typename ForEachItem>
void groupBy(std::size_t keys, std::uint32_t* begin, ForEachItem&& forEachItem) {
  for (std::size_t k = 1; k <= keys; ++k) begin[k] += begin[k - 1];
  forEachItem([begin](std::size_t key) { return begin[key]++; });
  // Each begin has moved to the begin of the next key: back again.
  std::copy_backward(begin, begin + keys, begin + keys + 1);
  begin[0] = 0;
}

}  // namespace bki_mapping
