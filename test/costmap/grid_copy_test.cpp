// The copy of projected_map that a costmap's layer reads: each cell against a search through the messages,
// and its bounds.
#include "costmap/grid_copy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace bki_mapping::costmap {
namespace {

using Grid = nav_msgs::OccupancyGrid;
using Update = map_msgs::OccupancyGridUpdate;

Grid gridOf(unsigned width, unsigned height, double x, double y, std::int8_t value, double stamp = 0) {
  Grid grid;
  grid.header.frame_id = "map";
  grid.header.stamp.fromSec(stamp);
  grid.info.resolution = 0.1f;
  grid.info.width = width;
  grid.info.height = height;
  grid.info.origin.position.x = x;
  grid.info.origin.position.y = y;
  grid.info.origin.orientation.w = 1;
  grid.data.assign(std::size_t{width} * height, value);
  return grid;
}

Update::Ptr updateOf(int x, int y, unsigned width, unsigned height, std::int8_t value, double stamp = 0) {
  Update::Ptr update(new Update);
  update->header.frame_id = "map";
  update->header.stamp.fromSec(stamp);
  update->x = x;
  update->y = y;
  update->width = width;
  update->height = height;
  update->data.assign(std::size_t{width} * height, value);
  return update;
}

/// A costmap, filled with one cost.
struct Costmap {
  unsigned width, height;
  double x, y, resolution;
  std::vector<std::uint8_t> costs;

  Costmap(unsigned w, unsigned h, double origin_x, double origin_y, double r, std::uint8_t cost)
      : width(w), height(h), x(origin_x), y(origin_y), resolution(r), costs(std::size_t{w} * h, cost) {}
  Window window() {
    return {costs.data(), width, x, y, resolution, 0, 0, static_cast<int>(width), static_cast<int>(height)};
  }
};

TEST(GridCopy, ConvertsCosts) {
  EXPECT_EQ(costOf(-1), kNoInformation);
  EXPECT_EQ(costOf(0), 0);
  EXPECT_EQ(costOf(30), 76);
  EXPECT_EQ(costOf(60), 153);
  EXPECT_EQ(costOf(99), kMaxPassable);
  for (const int lethal : {100, 101, 127, -2, -128})
    EXPECT_EQ(costOf(static_cast<std::int8_t>(lethal)), kLethal) << lethal;
  for (int v = 1; v < 100; ++v)
    EXPECT_GT(costOf(static_cast<std::int8_t>(v)), costOf(static_cast<std::int8_t>(v - 1)));
}

/// What the sum of all messages says of a cell of the costmap: every cell of the grid whose centre lies under
/// it counts.
std::uint8_t expected(const Grid& grid, const Costmap& costmap, unsigned i, unsigned j,
                      const Affine& to_costmap, std::uint8_t before, bool write_unknown,
                      Combination combination) {
  int highest = -2;
  const double r = grid.info.resolution;
  for (unsigned row = 0; row < grid.info.height; ++row) {
    for (unsigned column = 0; column < grid.info.width; ++column) {
      const double gx = grid.info.origin.position.x + (column + 0.5) * r,
                   gy = grid.info.origin.position.y + (row + 0.5) * r;
      const double px = to_costmap.xx * gx + to_costmap.xy * gy + to_costmap.x;
      const double py = to_costmap.yx * gx + to_costmap.yy * gy + to_costmap.y;
      if (std::floor((px - costmap.x) / costmap.resolution) != i) continue;
      if (std::floor((py - costmap.y) / costmap.resolution) != j) continue;
      const int value = grid.data[std::size_t{row} * grid.info.width + column];
      if (value != -1 || write_unknown) highest = std::max(highest, value);
    }
  }
  if (highest == -2) return before;
  const std::uint8_t cost = highest == -1    ? 255
                            : highest == 100 ? 254
                                             : static_cast<std::uint8_t>(highest * 252.0 / 99 + 0.5);
  if (combination == Combination::kOverwrite) return cost;
  if (cost == 255) return before;
  return before == 255 ? cost : std::max(before, cost);
}

TEST(GridCopy, WritesWhatASearchThroughAllCellsFinds) {
  std::mt19937 random(7);
  const std::int8_t values[] = {-1, -1, 0, 0, 30, 60, 99, 100};
  const Affine straight{1, 0, 0.7, 0, 1, -1.3}, back{1, 0, -0.7, 0, 1, 1.3};
  const Affine turned{0, -1, 0.7, 1, 0, -1.3}, turned_back{0, 1, 1.3, -1, 0, 0.7};
  for (const bool write_unknown : {false, true}) {
    for (const auto combination : {Combination::kOverwrite, Combination::kMaximum}) {
      for (const double resolution : {0.1, 0.2, 0.5}) {
        for (const bool turns : {false, true}) {
          Grid grid = gridOf(40, 30, -2, -1, -1);
          for (auto& value : grid.data) value = values[random() % 8];
          GridCopy copy(write_unknown);
          ASSERT_EQ(copy.replace(grid), "");
          for (int k = 0; k < 20; ++k) {
            const auto update = updateOf(int(random() % 35), int(random() % 25), 5, 5, values[random() % 8]);
            ASSERT_EQ(copy.update(update), "");
            for (unsigned y = 0; y < 5; ++y) {
              std::fill_n(grid.data.begin() + (update->y + int(y)) * 40 + update->x, 5, update->data[0]);
            }
          }
          for (const int before : {0, 120, 255}) {
            Costmap costmap(30, 24, -2, -1, resolution, static_cast<std::uint8_t>(before));
            ASSERT_TRUE(copy.write(costmap.window(), turns ? turned : straight, combination));
            std::size_t written = 0;
            for (unsigned j = 0; j < costmap.height; ++j) {
              for (unsigned i = 0; i < costmap.width; ++i) {
                const int cost = costmap.costs[j * costmap.width + i];
                written += cost != before;
                ASSERT_EQ(cost, expected(grid, costmap, i, j, turns ? turned_back : back,
                                         std::uint8_t(before), write_unknown, combination))
                    << i << ", " << j << " of cells of " << resolution << " m, turned " << turns
                    << ", unknown " << write_unknown;
              }
            }
            EXPECT_GT(written, 20u);
          }
        }
      }
    }
  }
}

TEST(GridCopy, LosesNoObstacleUnderTurnedAndCoarseCells) {
  Grid grid = gridOf(60, 60, -3, -3, 0);
  for (double angle = 0; angle < 1.6; angle += 0.1) {
    for (const double resolution : {0.1, 0.17, 0.5}) {
      for (const std::size_t cell : {1830u, 1234u, 2345u}) {
        grid.data.assign(grid.data.size(), 0);
        grid.data[cell] = 100;
        GridCopy copy(false);
        ASSERT_EQ(copy.replace(grid), "");
        Costmap costmap(100, 100, -50 * resolution, -50 * resolution, resolution, 255);
        const double c = std::cos(angle), s = std::sin(angle);
        ASSERT_TRUE(copy.write(costmap.window(), {c, -s, 0.03, s, c, 0.05}, Combination::kOverwrite));
        EXPECT_GT(std::count(costmap.costs.begin(), costmap.costs.end(), kLethal), 0)
            << angle << " " << resolution;
      }
    }
  }
}

TEST(GridCopy, ReportsOnlyWhatChanged) {
  GridCopy copy(false);
  ASSERT_EQ(copy.replace(gridOf(20, 10, -1, -0.5, -1, 1)), "");
  EXPECT_FALSE(copy.takeChanges());  // anywhere
  ASSERT_TRUE(copy.takeChanges());
  EXPECT_TRUE(copy.takeChanges()->empty());

  ASSERT_EQ(copy.update(updateOf(3, 2, 4, 5, 100, 2)), "");
  const auto updated = copy.takeChanges();
  ASSERT_TRUE(updated);
  EXPECT_NEAR(updated->min_x, -0.7, 1e-6);
  EXPECT_NEAR(updated->min_y, -0.3, 1e-6);
  EXPECT_NEAR(updated->max_x, -0.3, 1e-6);
  EXPECT_NEAR(updated->max_y, 0.2, 1e-6);

  // The grid grows: what it had is where it was, and only a new obstacle is a change.
  Grid larger = gridOf(60, 50, -3, -2.5, -1, 3);
  for (int y = 0; y < 5; ++y) std::fill_n(larger.data.begin() + (22 + y) * 60 + 23, 4, 100);
  larger.data[49 * 60 + 59] = 100;
  ASSERT_EQ(copy.replace(larger), "");
  const auto grown = copy.takeChanges();
  ASSERT_TRUE(grown);
  EXPECT_NEAR(grown->min_x, 2.9, 1e-5);
  EXPECT_NEAR(grown->min_y, 2.4, 1e-5);
  EXPECT_NEAR(grown->max_x, 3.0, 1e-5);
  EXPECT_NEAR(grown->max_y, 2.5, 1e-5);

  // It shrinks and loses both.
  ASSERT_EQ(copy.replace(gridOf(2, 2, 0, 0, -1, 4)), "");
  const auto shrunk = copy.takeChanges();
  ASSERT_TRUE(shrunk);
  EXPECT_NEAR(shrunk->min_x, -0.7, 1e-5);
  EXPECT_NEAR(shrunk->min_y, -0.3, 1e-5);
  EXPECT_NEAR(shrunk->max_x, 3.0, 1e-5);
  EXPECT_NEAR(shrunk->max_y, 2.5, 1e-5);

  // Moved by half a cell, or in another frame.
  ASSERT_EQ(copy.replace(gridOf(2, 2, 0.05, 0, -1, 5)), "");
  EXPECT_FALSE(copy.takeChanges());
  Grid elsewhere = gridOf(2, 2, 0.05, 0, -1, 6);
  elsewhere.header.frame_id = "odom";
  ASSERT_EQ(copy.replace(elsewhere), "");
  EXPECT_FALSE(copy.takeChanges());
}

TEST(GridCopy, PutsMessagesThatOvertakeEachOtherInOrder) {
  const auto cost = [](const GridCopy& copy, double x) {
    Costmap costmap(1, 1, x, 0, 0.1, 7);
    copy.write(costmap.window(), {}, Combination::kOverwrite);
    return int(costmap.costs[0]);
  };
  // The update is of a grid that has not come.
  GridCopy copy(false);
  ASSERT_EQ(copy.replace(gridOf(10, 10, 0, 0, 0, 1)), "");
  EXPECT_NE(copy.update(updateOf(25, 0, 1, 1, 100, 3)), "");
  ASSERT_EQ(copy.replace(gridOf(30, 10, 0, 0, 0, 2)), "");
  EXPECT_EQ(cost(copy, 2.5), kLethal);
  // The grid already has the update.
  ASSERT_EQ(copy.update(updateOf(0, 0, 1, 1, 100, 1.5)), "");
  EXPECT_EQ(cost(copy, 0), 0);
  // The clock was set back.
  ASSERT_EQ(copy.replace(gridOf(30, 10, 0, 0, 0, 1000)), "");
  ASSERT_EQ(copy.update(updateOf(0, 0, 1, 1, 100, 1)), "");
  EXPECT_EQ(cost(copy, 0), kLethal);
}

TEST(GridCopy, RefusesBadMessagesInOneSentenceAndKeepsTheGrid) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  GridCopy copy(false);
  ASSERT_EQ(copy.update(updateOf(0, 0, 1, 1, 100, 1)), "");  // before any grid
  ASSERT_EQ(copy.replace(gridOf(4, 4, 0, 0, 30, 1)), "");
  copy.takeChanges();

  const auto refuses = [&](const std::string& words, auto change) {
    Grid grid = gridOf(4, 4, 0, 0, 100, 2);
    change(grid);
    const std::string sentence = copy.replace(grid);
    EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
  };
  refuses("4 x 4 cells and has 15", [](Grid& grid) { grid.data.pop_back(); });
  refuses("4294967295 x 4294967295", [](Grid& grid) { grid.info.width = grid.info.height = ~0u; });
  refuses("65536 x 65536", [](Grid& grid) { grid.info.width = grid.info.height = 65536, grid.data.clear(); });
  for (const double r : {nan, 0.0, -1.0, 1e-6, std::numeric_limits<double>::infinity()}) {
    refuses("resolution", [r](Grid& grid) { grid.info.resolution = static_cast<float>(r); });
  }
  refuses("origin", [nan](Grid& grid) { grid.info.origin.position.y = nan; });
  refuses("origin", [](Grid& grid) { grid.info.origin.position.x = 1e300; });
  refuses("turned", [](Grid& grid) { grid.info.origin.orientation.z = 0.5; });
  refuses("turned", [nan](Grid& grid) { grid.info.origin.orientation.x = nan; });
  refuses("names no frame", [](Grid& grid) { grid.header.frame_id.clear(); });

  const auto refusesUpdate = [&](const std::string& words, const Update::Ptr& update) {
    const std::string sentence = copy.update(update);
    EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
  };
  refusesUpdate("outside", updateOf(3, 0, 2, 1, 100, 2));
  refusesUpdate("outside", updateOf(-1, 0, 1, 1, 100, 2));
  refusesUpdate("outside", updateOf(std::numeric_limits<int>::max(), 0, 2, 1, 100, 2));
  Update::Ptr cut = updateOf(0, 0, 2, 2, 100, 2);
  cut->data.pop_back();
  refusesUpdate("2 x 2 cells and has 3", cut);
  Update::Ptr elsewhere = updateOf(0, 0, 1, 1, 100, 2);
  elsewhere->header.frame_id = "odom";
  refusesUpdate("'odom'", elsewhere);

  ASSERT_TRUE(copy.takeChanges());
  EXPECT_TRUE(copy.takeChanges()->empty());
  Costmap costmap(4, 4, 0, 0, 0.1, 0);
  ASSERT_TRUE(copy.write(costmap.window(), {}, Combination::kMaximum));
  EXPECT_EQ(costmap.costs, std::vector<std::uint8_t>(16, 76));
  Costmap coarse(1, 1, 0, 0, 4, 0);
  EXPECT_FALSE(copy.write(coarse.window(), {}, Combination::kMaximum));
}

}  // namespace
}  // namespace bki_mapping::costmap
