/// @file Common parts of the publishers of 2D maps.
#pragma once

#include <ros/console.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bki_mapping/query/column_map.h"
#include "ros/map_publisher.h"
#include "ros/sentence_throttle.h"

namespace bki_mapping::ros_interface {

/// A rectangle of cells; each cell is a column of voxels.
struct CellRectangle {
  std::int32_t x = 0, y = 0;            ///< first column and row
  std::uint32_t width = 0, height = 0;  ///< [cells]

  bool contains(const ColumnMap::StackIndex& stack) const {
    const std::int64_t left = std::int64_t{stack.first} * kBlockEdge - x,
                       below = std::int64_t{stack.second} * kBlockEdge - y;
    return left >= 0 && below >= 0 && left < width && below < height;
  }

  /// The bounding rectangle of the stacks stackOf(*i), for i from `begin` to `end`.
  template <typename Iterator, typename StackOf>
  static CellRectangle around(Iterator begin, Iterator end, StackOf&& stackOf) {
    if (begin == end) return {};
    ColumnMap::StackIndex low = stackOf(*begin), high = low;
    for (; begin != end; ++begin) {
      const ColumnMap::StackIndex stack = stackOf(*begin);
      low = {std::min(low.first, stack.first), std::min(low.second, stack.second)};
      high = {std::max(high.first, stack.first), std::max(high.second, stack.second)};
    }
    return {low.first * kBlockEdge, low.second * kBlockEdge,
            static_cast<std::uint32_t>(high.first - low.first + 1) * kBlockEdge,
            static_cast<std::uint32_t>(high.second - low.second + 1) * kBlockEdge};
  }
};

/// Maintains a ColumnMap while there are subscribers.
class ColumnPublisher : public MapPublisher {
 public:
  void rest() override {
    MapPublisher::rest();
    known_ = false;
  }

 protected:
  static ColumnRules rulesOf(const ServerConfig& config) {
    return {config.occupancy_min_z, config.occupancy_max_z, config.occupancy_height};
  }

  /// Updates the columns. @return the updated stacks. @param all set to whether these are all of
  /// them.
  std::set<ColumnMap::StackIndex> look(const ServerSnapshot& snapshot, bool& all) {
    const SemanticMap& map = snapshot.map;
    all = changed.all() || !known_ || columns_.rules() != rulesOf(snapshot.config);
    if (!all) return columns_.update(map, snapshot.rules, snapshot.classes, changed.blocks());
    columns_.start(rulesOf(snapshot.config));
    known_ = true;
    return columns_.update(map, snapshot.rules, snapshot.classes);
  }

  /// Calls write(index in the rectangle's arrays, view) for every known column in a rectangle of whole
  /// blocks.
  template <typename Write>
  void forEachCell(const CellRectangle& r, Write&& write) const {
    const auto& all = columns_.columns();
    for (std::size_t x = 0; x < r.width; x += kBlockEdge) {
      const auto first = static_cast<std::int32_t>((r.x + static_cast<std::int64_t>(x)) / kBlockEdge);
      for (auto at = all.lower_bound({first, r.y / kBlockEdge}); at != all.end(); ++at) {
        if (at->first.first != first || !r.contains(at->first)) break;
        const auto y = static_cast<std::size_t>(at->first.second * kBlockEdge - r.y);
        for (std::size_t c = 0; c < at->second.size(); ++c) {
          write((y + c / kBlockEdge) * r.width + x + c % kBlockEdge, at->second[c]);
        }
      }
    }
  }

  /// Whether a message for the rectangle is of reasonable size. A single wrong pose far away can span a
  /// rectangle that exceeds the memory.
  static bool fits(const CellRectangle& r, std::size_t bytes_a_cell) {
    constexpr std::size_t kMaxBytes = std::size_t{1} << 28;
    return std::size_t{r.width} * r.height <= kMaxBytes / bytes_a_cell;
  }
  void warnOfSize(const CellRectangle& r) {
    const std::string why =
        topic() + " is not published: the map spans " + std::to_string(r.width) + " x " +
        std::to_string(r.height) +
        " columns of voxels, too many for a message; set window, call ~reset, or look for a "
        "pose that is far off";
    if (throttle_.allow(why, SentenceThrottle::Clock::now())) ROS_WARN("%s", why.c_str());
  }

  CellRectangle everything() const {
    return CellRectangle::around(columns_.columns().begin(), columns_.columns().end(),
                                 [](const auto& entry) { return entry.first; });
  }
  static CellRectangle around(const std::set<ColumnMap::StackIndex>& stacks) {
    return CellRectangle::around(stacks.begin(), stacks.end(), [](const auto& column) { return column; });
  }

 private:
  ColumnMap columns_;
  bool known_ = false;  ///< whether columns_ follows the map
  SentenceThrottle throttle_;
};

}  // namespace bki_mapping::ros_interface
