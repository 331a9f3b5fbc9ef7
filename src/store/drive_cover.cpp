#include "store/drive_cover.h"

#include <algorithm>
#include <numeric>

namespace bki_mapping {
namespace {

/// The search: takes the first drive that is not yet covered, and tries each set that contains it.
class Search {
 public:
  Search(const std::vector<DriveSet>& sets, std::vector<std::size_t> order)
      : sets_(sets), order_(std::move(order)) {}

  bool cover(const DriveSet& left) {
    if (left.empty()) return true;
    for (const std::size_t position : order_) {
      const DriveSet& set = sets_[position];
      if (set.count(*left.begin()) == 0 || !std::includes(left.begin(), left.end(), set.begin(), set.end())) {
        continue;
      }
      DriveSet rest;
      std::set_difference(left.begin(), left.end(), set.begin(), set.end(), std::inserter(rest, rest.end()));
      chosen_.push_back(position);
      if (cover(rest)) return true;
      chosen_.pop_back();
    }
    return false;
  }
  const std::vector<std::size_t>& chosen() const { return chosen_; }

 private:
  const std::vector<DriveSet>& sets_;
  std::vector<std::size_t> order_, chosen_;
};

}  // namespace

bool disjoint(const DriveSet& a, const DriveSet& b) {
  return std::none_of(a.begin(), a.end(), [&](const std::string& id) { return b.count(id) > 0; });
}

std::optional<std::vector<std::size_t>> exactCover(const DriveSet& drives, const std::vector<DriveSet>& sets,
                                                   bool smallest_first) {
  std::vector<std::size_t> order(sets.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (sets[a].size() != sets[b].size()) return (sets[a].size() < sets[b].size()) == smallest_first;
    return sets[a] < sets[b];
  });
  Search search(sets, std::move(order));
  if (!search.cover(drives)) return std::nullopt;
  return search.chosen();
}

}  // namespace bki_mapping
