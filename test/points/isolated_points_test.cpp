// Isolated points: equal to a comparison of each point with each, whatever the threads and the order; flakes
// are, and surfaces, poles and wires are not.
#include "points/isolated_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "reference/reference.h"

namespace bki_mapping {
namespace {

using PointList = std::vector<Eigen::Vector3f>;

std::vector<std::uint8_t> isolatedOf(const PointList& points, float within = 15.0f, int threads = 2) {
  ThreadPool pool(threads);
  IsolatedPoints isolation;
  return isolation.find(points, within, pool);
}

std::size_t countIn(const std::vector<std::uint8_t>& isolated) {
  return static_cast<std::size_t>(std::count(isolated.begin(), isolated.end(), 1));
}

Eigen::Vector3f beam(double azimuth, double elevation, double range) {
  return (range * Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                                  std::sin(azimuth) * std::cos(elevation), std::sin(elevation)))
      .cast<float>();
}

constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// A scan of rows 2 degrees apart or denser inside of a cylinder, in which a function may put something
/// nearer.
template <typename Range>
PointList scanOf(int rows, double lowest, double highest, int columns, Range&& range) {
  PointList points;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double azimuth = 2.0 * M_PI * column / columns;
      const double elevation = (lowest + (highest - lowest) * row / (rows - 1)) * kDegree;
      const double wall = 12.0 / std::cos(elevation);
      points.push_back(beam(azimuth, elevation, range(azimuth, elevation, wall)));
    }
  }
  return points;
}

TEST(IsolatedPoints, EqualAComparisonOfEachWithEach) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::size_t found = 0, others = 0;
  for (int round = 0; round < 12; ++round) {
    const double flakes = 0.02 * (1 + round % 4), highest = round % 3 == 0 ? 89.0 : 15.0;
    PointList points = scanOf(
        16 + 8 * (round % 3), -15.0 - 20.0 * (round % 4), highest, 120,
        [&](double, double, double wall) { return unit(random) < flakes ? 1.0 + 8.0 * unit(random) : wall; });
    points.emplace_back(0.0f, 0.0f, 0.0f);
    points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 1.0f, 1.0f);
    points.emplace_back(std::numeric_limits<float>::infinity(), 1.0f, 1.0f);
    points.emplace_back(0.0f, 0.0f, 3.0f);
    points.emplace_back(0.0f, 0.0f, -3.0f);
    for (const float within : {15.0f, 5.0f, 30.0f}) {
      const std::vector<bool> expected = reference::isolatedPoints(points, within);
      const std::vector<std::uint8_t> isolated = isolatedOf(points, within);
      ASSERT_EQ(isolated.size(), points.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_EQ(isolated[i] != 0, expected[i]) << round << ", " << within << ", " << points[i].transpose();
      }
      found += countIn(isolated);
      others += isolated.size() - countIn(isolated);
    }
  }
  EXPECT_GT(found, 300u);
  EXPECT_GT(others, 500u);
}

TEST(IsolatedPoints, EqualAComparisonOfEachWithEachAmongDenseBeams) {
  // A part of a scan with 64 rows: a hedge 5 m away that beams pass, air that is thick or not, a wall.
  std::mt19937 random(10);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::size_t found = 0, behind = 0;
  for (const double particles : {0.02, 0.1, 0.3, 0.6}) {
    PointList points;
    std::vector<bool> is_behind;
    for (double elevation = -8.0; elevation < 6.0; elevation += 0.5) {
      for (double azimuth = 0.0; azimuth < 24.0; azimuth += 0.2) {
        const bool passes = unit(random) < 0.1;
        double range = azimuth < 10.0 ? (passes ? 5.0 + 2.0 * unit(random) : 5.0) : 12.0;
        is_behind.push_back(range > 5.0 && azimuth < 10.0);
        if (unit(random) < particles) {
          range = 1.5 + 8.0 * unit(random);
          is_behind.back() = false;
        }
        points.push_back(beam(azimuth * kDegree, elevation * kDegree, range));
      }
    }
    const std::vector<bool> expected = reference::isolatedPoints(points, 15.0);
    const std::vector<std::uint8_t> isolated = isolatedOf(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(isolated[i] != 0, expected[i]) << particles << ", " << points[i].transpose();
      behind += is_behind[i] && !isolated[i];
    }
    found += countIn(isolated);
  }
  EXPECT_GT(found, 1000u);
  EXPECT_GT(behind, 200u);
}

TEST(IsolatedPoints, DependOnNeitherThreadsNorOrder) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const PointList points = scanOf(32, -25.0, 5.0, 600, [&](double, double, double wall) {
    return unit(random) < 0.05 ? 1.0 + 6.0 * unit(random) : wall;
  });
  const std::vector<std::uint8_t> isolated = isolatedOf(points, 15.0f, 1);
  EXPECT_EQ(isolatedOf(points, 15.0f, 3), isolated);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), random);
  PointList shuffled;
  for (const std::size_t i : order) shuffled.push_back(points[i]);
  const std::vector<std::uint8_t> of_shuffled = isolatedOf(shuffled);
  for (std::size_t n = 0; n < order.size(); ++n) ASSERT_EQ(of_shuffled[n], isolated[order[n]]);
}

TEST(IsolatedPoints, AreFlakesBeforeAWall) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const int rows : {16, 64}) {
    std::vector<bool> is_flake;
    const PointList points = scanOf(rows, -15.0, 15.0, 1800, [&](double, double, double wall) {
      is_flake.push_back(unit(random) < 0.03);
      return is_flake.back() ? 1.5 + 7.0 * unit(random) : wall;
    });
    const std::vector<std::uint8_t> isolated = isolatedOf(points);
    std::size_t flakes = 0, found = 0, wrong = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      flakes += is_flake[i];
      (is_flake[i] ? found : wrong) += isolated[i];
    }
    EXPECT_GT(found, flakes * 99 / 100) << rows << " rows";
    EXPECT_EQ(wrong, 0u) << rows << " rows: the wall stays";
  }
}

TEST(IsolatedPoints, AreParticlesInThickFogBetweenTheThingsThere) {
  // Two thirds of the beams end in the fog; there is a post of 50 cm 5 m away.
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const int rows : {16, 64}) {
    std::vector<bool> is_fog, is_post;
    const PointList points = scanOf(rows, -15.0, 15.0, 1800, [&](double azimuth, double, double wall) {
      is_post.push_back(std::abs(azimuth - 2.0) < 0.05);
      const double range = 1.5 + 8.0 * unit(random), end = is_post.back() ? 5.0 : wall;
      is_fog.push_back(unit(random) < 0.67 && range < end);
      if (is_fog.back()) is_post.back() = false;
      return is_fog.back() ? range : end;
    });
    const std::vector<std::uint8_t> isolated = isolatedOf(points);
    std::size_t fog = 0, found = 0, post = 0, lost = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      fog += is_fog[i], found += is_fog[i] && isolated[i];
      post += is_post[i], lost += is_post[i] && isolated[i];
    }
    EXPECT_GT(found, fog * 99 / 100) << rows << " rows";
    EXPECT_GT(post, 20u) << rows << " rows";
    EXPECT_LT(lost, post / 10) << rows << " rows";
  }
}

TEST(IsolatedPoints, AreNotThosePointsThatABeamMeetsBehindSomething) {
  // One beam in fifty passes a hedge 5 m away, and ends up to 2 m behind its face.
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto behind = [&](double azimuth, double, double wall) {
    if (azimuth > 1.0) return wall;
    return unit(random) < 0.02 ? 5.0 + 2.0 * unit(random) : 5.0;
  };
  EXPECT_EQ(countIn(isolatedOf(scanOf(64, -15.0, 15.0, 1800, behind))), 0u);
  // Before a wall, they are.
  const auto before = [&](double azimuth, double, double wall) {
    return azimuth < 1.0 && unit(random) < 0.02 ? wall - 1.5 - 2.0 * unit(random) : wall;
  };
  EXPECT_GT(countIn(isolatedOf(scanOf(64, -15.0, 15.0, 1800, before))), 300u);
}

TEST(IsolatedPoints, AreNoPoleNoWireAndNoBar) {
  // 16 rows, 1800 columns: a pole 2.4 cm thick, and a bar as thick, 3 m away.
  const double half = std::atan(0.012 / 3.0);
  for (double at = 1.0; at < 1.05; at += 0.001) {
    const auto pole = [&](double azimuth, double, double wall) {
      return std::abs(azimuth - at) <= half ? 3.0 : wall;
    };
    EXPECT_EQ(countIn(isolatedOf(scanOf(16, -15.0, 15.0, 1800, pole))), 0u) << at;
  }
  const auto bar = [&](double azimuth, double elevation, double wall) {
    return std::abs(elevation + 3.0 * kDegree) <= half && azimuth < 1.0 ? 3.0 : wall;
  };
  EXPECT_EQ(countIn(isolatedOf(scanOf(16, -15.0, 15.0, 1800, bar))), 0u);
}

TEST(IsolatedPoints, AreNoSlantedWire) {
  // 2.4 cm thick, before the wall at x = 5 m, at a slope of 30 degrees; in clear air, and among flakes.
  for (const double flakes : {0.0, 0.02}) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<bool> is_wire;
    const PointList points = scanOf(64, -24.8, 2.0, 1800, [&](double azimuth, double elevation, double wall) {
      const double x = 5.0, y = x * std::tan(azimuth), z = std::hypot(x, y) * std::tan(elevation);
      const double aside = std::abs(z + 0.8 - y * std::tan(30.0 * kDegree)) * std::cos(30.0 * kDegree);
      const bool ahead = std::cos(azimuth) > 0.3 && std::abs(y) < 1.0;
      is_wire.push_back(ahead && aside < 0.012);
      if (is_wire.back()) return Eigen::Vector3d(x, y, z).norm();
      return unit(random) < flakes ? 1.5 + 7.0 * unit(random) : wall;
    });
    const std::vector<std::uint8_t> isolated = isolatedOf(points);
    std::size_t wire = 0, lost = 0;
    for (std::size_t i = 0; i < points.size(); ++i) wire += is_wire[i], lost += is_wire[i] && isolated[i];
    EXPECT_GT(wire, 50u);
    EXPECT_LE(lost, wire / 20) << flakes;
  }
}

TEST(IsolatedPoints, AreOnlyThoseWithinTheDistanceAndAmongOthers) {
  const auto flakeAt = [](double range) {
    return scanOf(16, -15.0, 15.0, 900,
                  [range, n = 0](double, double, double wall) mutable { return ++n == 7000 ? range : wall; });
  };
  EXPECT_EQ(countIn(isolatedOf(flakeAt(4.0))), 1u);
  EXPECT_EQ(countIn(isolatedOf(flakeAt(4.0), 3.5f)), 0u);
  EXPECT_EQ(countIn(isolatedOf(flakeAt(9.0), 8.0f)), 0u);
  EXPECT_EQ(countIn(isolatedOf({{3, 0, 0}, {3, 1, 0}, {0, 5, 1}})), 0u) << "too few to tell";
  PointList few = {beam(0, 0, 3), beam(0.01, 0, 9), beam(0.01, 0.01, 9.05), beam(0, 0.01, 9.1)};
  EXPECT_EQ(isolatedOf(few), (std::vector<std::uint8_t>{1, 0, 0, 0})) << "three others are enough";
  few.pop_back();
  EXPECT_EQ(countIn(isolatedOf(few)), 0u) << "two are not";
  EXPECT_TRUE(isolatedOf({}).empty());
}

TEST(DirectionCells, CoverTheSphereAndAreAboutADegreeWide) {
  const DirectionCells cells;
  std::set<std::uint32_t> seen;
  for (double elevation = -89.9; elevation < 90.0; elevation += 0.2) {
    const bool at_pole = std::abs(elevation) > 85.0;  // columns are narrow there
    for (double azimuth = 0.0; azimuth < 360.0; azimuth += 0.2) {
      const Eigen::Vector3f point = beam(azimuth * kDegree, elevation * kDegree, 7.0);
      const std::uint32_t cell = cells.placeOf(point, point.norm()).cell;
      ASSERT_LT(cell, cells.size());
      seen.insert(cell);
      // Half a degree aside is at most one row and one column farther.
      const Eigen::Vector3f aside = beam(azimuth * kDegree, (elevation + 0.5) * kDegree, 7.0);
      const std::uint32_t other = cells.placeOf(aside, aside.norm()).cell;
      bool around = false;
      cells.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row&) {
        around |= other >= first && other <= last;
      });
      ASSERT_TRUE(around || at_pole) << azimuth << ", " << elevation;
    }
  }
  EXPECT_EQ(seen.size(), cells.size());
}

TEST(DirectionCells, EachOfThoseAroundIsVisitedOnce) {
  const DirectionCells cells;
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    std::set<std::uint32_t> visited;
    std::size_t visits = 0;
    cells.visitAround(cell, [&](std::uint32_t first, std::uint32_t last, const DirectionCells::Row&) {
      for (std::uint32_t c = first; c <= last; ++c) visited.insert(c), ++visits;
    });
    ASSERT_EQ(visited.size(), visits) << cell;
    ASSERT_TRUE(visited.count(cell)) << cell;
    ASSERT_LE(visits, 25u) << cell;
  }
}

TEST(IsolatedPoints, SlicesRiseWithTheRange) {
  EXPECT_EQ(IsolatedPoints::sliceOf(0.0f), 0);
  for (float range = 0.0f; range < 40.0f; range += 0.01f) {
    const int slice = IsolatedPoints::sliceOf(range), farther = IsolatedPoints::sliceOf(range + 0.01f);
    ASSERT_TRUE(farther == slice || farther == slice + 1) << range;
    if (range + (range + 2.0f) / 32.0f > IsolatedPoints::kFarthest) continue;
    ASSERT_GT(IsolatedPoints::sliceOf(range + (range + 2.0f) / 32.0f), slice) << range;
  }
  EXPECT_EQ(IsolatedPoints::sliceOf(30.0f), IsolatedPoints::kSlices - 1);
  EXPECT_EQ(IsolatedPoints::sliceOf(1e5f), IsolatedPoints::kSlices - 1);
}

}  // namespace
}  // namespace bki_mapping
