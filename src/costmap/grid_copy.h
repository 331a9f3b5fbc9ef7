/// @file A copy of projected_map, which a layer of a costmap reads. Knows nothing of costmap_2d.
#pragma once

#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace bki_mapping::costmap {

/// Costs as costmap_2d has them; what lies between kMaxPassable and kLethal, inflation alone writes.
constexpr std::uint8_t kMaxPassable = 252, kLethal = 254, kNoInformation = 255;

/// The cost of a value of projected_map: -1 is kNoInformation, 0 to 99 are 0 to kMaxPassable in proportion,
/// and all else is kLethal.
std::uint8_t costOf(std::int8_t value);

/// How costs of the layer and of the layers below it become one; numbered as `combination_method` of
/// costmap_2d's layers.
enum class Combination { kOverwrite = 0, kMaximum = 1 };

/// An area [m], empty unless it has been made to include something.
struct Box {
  double min_x = std::numeric_limits<double>::infinity(), min_y = min_x;
  double max_x = -std::numeric_limits<double>::infinity(), max_y = max_x;

  bool empty() const { return !(min_x <= max_x && min_y <= max_y); }
  void include(double x, double y);
  void include(const Box& other);
};

/// Maps points of one plane to another [m]; rows of a matrix.
struct Affine {
  double xx = 1, xy = 0, x = 0;
  double yx = 0, yy = 1, y = 0;

  bool operator==(const Affine& other) const;
  /// The smallest box around the image of a box.
  Box boxAround(const Box& box) const;
};

/// Cells of a costmap: columns [min_i, max_i) of rows [min_j, max_j), which lie within it.
struct Window {
  std::uint8_t* costs = nullptr;                      ///< of the whole costmap, row by row
  unsigned int width = 0;                             ///< of the whole costmap [cells]
  double origin_x = 0, origin_y = 0, resolution = 0;  ///< of the whole costmap [m]
  int min_i = 0, min_j = 0, max_i = 0, max_j = 0;
};

/// The grid, and where it changed. Not safe for threads.
class GridCopy {
 public:
  /// How many times finer than a costmap the grid may be.
  static constexpr int kMaxFiner = 32;

  /// @param write_unknown whether cells of value -1 have a cost, kNoInformation, or none.
  explicit GridCopy(bool write_unknown) : write_unknown_(write_unknown) {}

  /// Takes over a message of projected_map. @return "", or in one sentence why it is refused; then the copy
  /// stays as it was.
  std::string replace(const nav_msgs::OccupancyGrid& grid);
  /// Likewise of projected_map_updates. Topics overtake each other: updates up to 10 s older than the grid
  /// are left out, because the grid has them, and the last ones wait in case the grid that they belong to is
  /// still to come.
  std::string update(const map_msgs::OccupancyGridUpdate::ConstPtr& update);

  /// Whether there is a grid.
  bool known() const { return !frame_.empty(); }
  const std::string& frame() const { return frame_; }
  double resolution() const { return resolution_; }
  Box extent() const { return boxOf(0, 0, width_, height_); }

  /// The area in the frame of the grid where costs changed since the last call; nullopt if it may be
  /// anywhere, because the grid moved by parts of a cell, or has other cells or another frame.
  std::optional<Box> takeChanges();

  /// Writes into the window. A cell of the costmap takes the highest cost of the grid's cells under it, so
  /// that no obstacle falls between coarse cells; without any it stays as it is. With kMaximum, only a known
  /// cost that exceeds the one there, or finds kNoInformation, is written. @param to_grid from the frame of
  /// the costmap to that of the grid.
  /// @return false if the grid is more than kMaxFiner times finer than the costmap; then nothing is written.
  bool write(const Window& window, const Affine& to_grid, Combination combination) const;

 private:
  using Update = map_msgs::OccupancyGridUpdate;

  Box boxOf(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height) const;
  /// The value of a cell, 100 instead of those below -1, or kNone where the layer has no cost.
  int valueAt(std::int64_t x, std::int64_t y) const;
  std::string apply(const Update& update);
  std::optional<std::uint8_t> costUnder(double x, double y, const Affine& to_grid, double side,
                                        int samples) const;

  bool write_unknown_;
  std::string frame_;
  ros::Time stamp_;
  double resolution_ = 0, origin_x_ = 0, origin_y_ = 0;
  std::int64_t width_ = 0, height_ = 0;
  std::vector<std::int8_t> values_;
  bool changed_anywhere_ = false;
  Box changes_;
  std::deque<Update::ConstPtr> recent_updates_;
};

}  // namespace bki_mapping::costmap
