/// @file Finds what lies near a place, without a look at everything.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "parallel/counter_random.h"

namespace bki_mapping::simulation {

/// The numbers of things, by the square cells of the plane in which they lie.
class PlaneIndex {
 public:
  /// @param edge of a cell [m], > 0.
  explicit PlaneIndex(double edge) : edge_(edge) {}

  void add(std::uint32_t number, const Eigen::AlignedBox2d& bounds) {
    forEachCell(bounds, [&](std::uint64_t cell) {
      std::vector<std::uint32_t>& here = cells_[cell];
      if (here.empty() || here.back() != number) here.push_back(number);
    });
  }
  void add(std::uint32_t number, const Eigen::Vector2d& point) {
    add(number, Eigen::AlignedBox2d(point, point));
  }

  /// Calls visit(number) for all whose cells meet a square, for some more than once.
  /// @param reach half the edge of the square [m].
  template <typename Visit>
  void forEachNear(const Eigen::Vector2d& at, double reach, Visit&& visit) const {
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(reach);
    forEachCell(Eigen::AlignedBox2d(at - half, at + half), [&](std::uint64_t cell) {
      const auto here = cells_.find(cell);
      if (here == cells_.end()) return;
      for (const std::uint32_t number : here->second) visit(number);
    });
  }
  /// The same numbers in ascending order, each once.
  std::vector<std::uint32_t> near(const Eigen::Vector2d& at, double reach) const {
    std::vector<std::uint32_t> numbers;
    forEachNear(at, reach, [&](std::uint32_t number) { numbers.push_back(number); });
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
  }

 private:
  struct Mixed {
    std::size_t operator()(std::uint64_t key) const { return static_cast<std::size_t>(mixBits(key)); }
  };

  template <typename Visit>
  void forEachCell(const Eigen::AlignedBox2d& box, Visit&& visit) const {
    const auto cellOf = [&](double c) { return static_cast<std::int64_t>(std::floor(c / edge_)); };
    for (std::int64_t x = cellOf(box.min().x()); x <= cellOf(box.max().x()); ++x) {
      for (std::int64_t y = cellOf(box.min().y()); y <= cellOf(box.max().y()); ++y)
        visit((static_cast<std::uint64_t>(x) << 32) ^ (static_cast<std::uint64_t>(y) & 0xffffffffu));
    }
  }

  double edge_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>, Mixed> cells_;
};

}  // namespace bki_mapping::simulation
