#include "costmap/grid_copy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace bki_mapping::costmap {
namespace {

/// In place of a value where the layer has no cost; below all values.
constexpr int kNone = -2;
constexpr std::size_t kRecentUpdates = 8;
/// Older updates come from a clock that was set back.
constexpr double kMaxUpdateAge = 10;      // [s]
constexpr double kMinResolution = 0.001;  // [m]
/// Larger coordinates cannot tell cells of a millimetre apart.
constexpr double kMaxCoordinate = 1e9;  // [m]

std::string text(std::int64_t number) {
  return std::to_string(number);
}

/// Why the cells do not have this size; "" if they have.
std::string wrongSize(const char* topic, std::uint32_t width, std::uint32_t height, std::size_t size) {
  if (std::uint64_t{width} * height == size) return "";
  return std::string("a message on ") + topic + " says " + text(width) + " x " + text(height) +
         " cells and has " + std::to_string(size);
}

std::string wrongGeometry(const nav_msgs::OccupancyGrid& grid) {
  if (grid.header.frame_id.empty()) return "the grid names no frame";
  const double resolution = grid.info.resolution;
  if (!(resolution >= kMinResolution && resolution <= kMaxCoordinate)) {
    return "the resolution of the grid is " + std::to_string(resolution) + " m; it must be at least 0.001 m";
  }
  const auto& origin = grid.info.origin;
  if (!(std::abs(origin.position.x) <= kMaxCoordinate && std::abs(origin.position.y) <= kMaxCoordinate)) {
    return "the origin of the grid is not a place within 1e9 m";
  }
  const auto zero = [](double q) { return std::abs(q) < 1e-6; };
  if (!zero(origin.orientation.x) || !zero(origin.orientation.y) || !zero(origin.orientation.z)) {
    return "the grid is turned in its frame; the layer reads grids along the axes only";
  }
  return "";
}

}  // namespace

std::uint8_t costOf(std::int8_t value) {
  if (value == -1) return kNoInformation;
  if (value < 0 || value > 99) return kLethal;
  return static_cast<std::uint8_t>(std::lround(value * (kMaxPassable / 99.0)));
}

void Box::include(double x, double y) {
  min_x = std::min(min_x, x);
  min_y = std::min(min_y, y);
  max_x = std::max(max_x, x);
  max_y = std::max(max_y, y);
}

void Box::include(const Box& other) {
  if (other.empty()) return;
  include(other.min_x, other.min_y);
  include(other.max_x, other.max_y);
}

bool Affine::operator==(const Affine& other) const {
  const auto all = [](const Affine& a) { return std::array<double, 6>{a.xx, a.xy, a.x, a.yx, a.yy, a.y}; };
  return all(*this) == all(other);
}

Box Affine::boxAround(const Box& box) const {
  Box around;
  if (box.empty()) return around;
  for (const double px : {box.min_x, box.max_x}) {
    for (const double py : {box.min_y, box.max_y})
      around.include(xx * px + xy * py + x, yx * px + yy * py + y);
  }
  return around;
}

Box GridCopy::boxOf(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height) const {
  Box box;
  if (width <= 0 || height <= 0) return box;
  const auto at = [this](double origin, std::int64_t i) {
    return origin + static_cast<double>(i) * resolution_;
  };
  box.include(at(origin_x_, x), at(origin_y_, y));
  box.include(at(origin_x_, x + width), at(origin_y_, y + height));
  return box;
}

int GridCopy::valueAt(std::int64_t x, std::int64_t y) const {
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return kNone;
  const int value = values_[static_cast<std::size_t>(y * width_ + x)];
  if (value == -1) return write_unknown_ ? value : kNone;
  return value < 0 ? 100 : value;
}

std::string GridCopy::replace(const nav_msgs::OccupancyGrid& grid) {
  std::string wrong = wrongGeometry(grid);
  if (wrong.empty()) wrong = wrongSize("projected_map", grid.info.width, grid.info.height, grid.data.size());
  if (!wrong.empty()) return wrong;

  GridCopy next(write_unknown_);
  next.frame_ = grid.header.frame_id;
  next.stamp_ = grid.header.stamp;
  next.resolution_ = grid.info.resolution;
  next.origin_x_ = grid.info.origin.position.x;
  next.origin_y_ = grid.info.origin.position.y;
  next.width_ = grid.info.width;
  next.height_ = grid.info.height;
  next.values_.assign(grid.data.begin(), grid.data.end());
  // Cell (0, 0) of the new grid in the old one.
  const double x = (next.origin_x_ - origin_x_) / next.resolution_,
               y = (next.origin_y_ - origin_y_) / next.resolution_;
  const auto whole = [](double cells) { return std::abs(cells - std::round(cells)) < 0.01; };
  if (frame_ != next.frame_ || resolution_ != next.resolution_ || !whole(x) || !whole(y)) {
    next.changed_anywhere_ = true;
  } else {
    next.changes_ = changes_;
    next.changed_anywhere_ = changed_anywhere_;
    const auto dx = static_cast<std::int64_t>(std::round(x)), dy = static_cast<std::int64_t>(std::round(y));
    // Only where one of the two has cells; the gap between grids far from each other may be large.
    const auto compare = [&](std::int64_t left, std::int64_t bottom, std::int64_t right, std::int64_t top) {
      for (std::int64_t row = bottom; row < top; ++row) {
        std::int64_t first = right, last = left - 1;
        for (std::int64_t column = left; column < right; ++column) {
          if (next.valueAt(column, row) == valueAt(column + dx, row + dy)) continue;
          first = std::min(first, column);
          last = column;
        }
        next.changes_.include(next.boxOf(first, row, last - first + 1, 1));
      }
    };
    compare(0, 0, next.width_, next.height_);
    compare(-dx, -dy, width_ - dx, height_ - dy);
  }
  std::swap(next.recent_updates_, recent_updates_);
  *this = std::move(next);

  const auto older = [this](const Update::ConstPtr& each) { return each->header.stamp <= stamp_; };
  recent_updates_.erase(std::remove_if(recent_updates_.begin(), recent_updates_.end(), older),
                        recent_updates_.end());
  for (const Update::ConstPtr& each : recent_updates_) apply(*each);
  return "";
}

std::string GridCopy::update(const Update::ConstPtr& update) {
  const std::string wrong =
      wrongSize("projected_map_updates", update->width, update->height, update->data.size());
  if (!wrong.empty()) return wrong;
  recent_updates_.push_back(update);
  if (recent_updates_.size() > kRecentUpdates) recent_updates_.pop_front();
  if (!known()) return "";
  const double age = (stamp_ - update->header.stamp).toSec();
  if (age > 0 && age < kMaxUpdateAge) return "";
  return apply(*update);
}

std::string GridCopy::apply(const Update& update) {
  if (update.header.frame_id != frame_) {
    return "an update is in the frame '" + update.header.frame_id + "', and the grid in '" + frame_ + "'";
  }
  if (update.x < 0 || update.y < 0 || update.x + std::int64_t{update.width} > width_ ||
      update.y + std::int64_t{update.height} > height_) {
    return "an update of " + text(update.width) + " x " + text(update.height) + " cells at (" +
           text(update.x) + ", " + text(update.y) + ") lies outside of the grid, which has " + text(width_) +
           " x " + text(height_);
  }
  for (std::int64_t row = 0; row < update.height; ++row) {
    const auto from = update.data.begin() + row * std::int64_t{update.width};
    std::copy(from, from + update.width, values_.begin() + (update.y + row) * width_ + update.x);
  }
  changes_.include(boxOf(update.x, update.y, update.width, update.height));
  return "";
}

std::optional<Box> GridCopy::takeChanges() {
  const Box changes = std::exchange(changes_, Box());
  if (std::exchange(changed_anywhere_, false)) return std::nullopt;
  return changes;
}

std::optional<std::uint8_t> GridCopy::costUnder(double x, double y, const Affine& to_grid, double side,
                                                int samples) const {
  int highest = kNone;
  for (int j = 0; j < samples; ++j) {
    const double py = y + side * ((j + 0.5) / samples - 0.5);
    for (int i = 0; i < samples; ++i) {
      const double px = x + side * ((i + 0.5) / samples - 0.5);
      const double cx = std::floor((to_grid.xx * px + to_grid.xy * py + to_grid.x - origin_x_) / resolution_);
      const double cy = std::floor((to_grid.yx * px + to_grid.yy * py + to_grid.y - origin_y_) / resolution_);
      if (!(cx >= 0 && cy >= 0 && cx < static_cast<double>(width_) && cy < static_cast<double>(height_)))
        continue;
      const int value = valueAt(static_cast<std::int64_t>(cx), static_cast<std::int64_t>(cy));
      highest = std::max(highest, value);
    }
  }
  if (highest == kNone) return std::nullopt;
  return costOf(static_cast<std::int8_t>(highest));
}

bool GridCopy::write(const Window& window, const Affine& to_grid, Combination combination) const {
  if (!known()) return true;
  const double ratio = window.resolution / resolution_;
  if (!(ratio <= kMaxFiner)) return false;
  // Samples are so dense that each cell of the grid within one of the costmap has one: along the axes, as far
  // apart as cells are; otherwise, such that one lies in the circle within a cell. The resolution of a grid
  // is a float.
  const bool along = std::abs(to_grid.xy) + std::abs(to_grid.yx) < 1e-9;
  const int samples = std::max(1, static_cast<int>(std::ceil(ratio * (along ? 1 : std::sqrt(2.0)) - 1e-3)));
  for (int j = window.min_j; j < window.max_j; ++j) {
    const double y = window.origin_y + (j + 0.5) * window.resolution;
    std::uint8_t* const row = window.costs + static_cast<std::size_t>(j) * window.width;
    for (int i = window.min_i; i < window.max_i; ++i) {
      const double x = window.origin_x + (i + 0.5) * window.resolution;
      const auto cost = costUnder(x, y, to_grid, window.resolution, samples);
      if (!cost) continue;
      const bool higher = *cost != kNoInformation && (row[i] == kNoInformation || *cost > row[i]);
      if (combination == Combination::kOverwrite || higher) row[i] = *cost;
    }
  }
  return true;
}

}  // namespace bki_mapping::costmap
