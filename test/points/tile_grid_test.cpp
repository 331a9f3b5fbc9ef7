// Batches of points get the same tiles and cells as single points, with every instruction set.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "points/point_kernels.h"
#include "simd/instruction_sets.h"

namespace bki_mapping {
namespace {

struct Points {
  std::vector<float> x, y, z;

  void add(float px, float py, float pz) {
    x.push_back(px);
    y.push_back(py);
    z.push_back(pz);
  }
  PointSpan span() const { return {{x.data(), y.data(), z.data()}}; }
  Eigen::Vector3d at(std::size_t i) const { return Eigen::Vector3f(x[i], y[i], z[i]).cast<double>(); }
};

/// A full batch of points: random ones, ones on the faces of cells, and ones a few roundings beside these.
Points nastyPoints(double cell, const Eigen::Vector3d& origin) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> anywhere(-80.0f, 80.0f);
  std::uniform_int_distribution<int> face(-300, 300), hairs(-12, 12);
  Points points;
  while (points.x.size() < kBatch) {
    const auto beside = [&](int axis) {
      // A coordinate within a few roundings of a cell's face.
      const double at = std::round(origin[axis] / cell) + face(random);
      float coordinate = static_cast<float>(at * cell - origin[axis]);
      const int count = hairs(random);
      for (int n = 0; n < std::abs(count); ++n) {
        coordinate = std::nextafter(coordinate, count > 0 ? 1e9f : -1e9f);
      }
      return coordinate;
    };
    const auto on = [&] { return static_cast<float>(face(random) * cell); };
    points.add(anywhere(random), anywhere(random), anywhere(random));
    points.add(on(), on(), anywhere(random));
    points.add(beside(0), beside(1), beside(2));
    points.add(beside(0), anywhere(random), beside(2));
  }
  return points;
}

int floorDivide(int a, int b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

TEST(TileGrid, LocatesPointsWhereGridGeometryDoes) {
  for (const std::string& set : instructionSets()) {
    for (const double cell : {0.1, 0.3, 1.0}) {
      for (const int edge : {1, 7, 8, 24, 32}) {
        for (const Eigen::Vector3d& origin : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-3.7, 1234.56, 2.1),
                                              Eigen::Vector3d(0.3, -0.3, 1.2)}) {
          const Points points = nastyPoints(cell, origin);
          const GridGeometry geometry(cell);
          const TileGrid grid(geometry, origin, edge);
          TilePositions positions;
          pointKernelsFor(set).locate_points(grid, points.span(), kBatch - 3, positions);
          TilePositions cells;
          pointKernelsFor(set).locate_cells(grid, points.span(), kBatch - 3, cells);
          for (std::size_t i = 0; i < kBatch - 3; ++i) {
            ASSERT_EQ(cells.tileOf(i), positions.tileOf(i)) << set << ", edge " << edge << ", point " << i;
            ASSERT_EQ(cells.cell[i], positions.cell[i]) << set << ", edge " << edge << ", point " << i;
            const Eigen::Vector3d p = origin + points.at(i);
            const VoxelIndex v = geometry.voxelAt(p);
            const GridIndex tile{floorDivide(v.x, edge), floorDivide(v.y, edge), floorDivide(v.z, edge)};
            ASSERT_EQ(positions.tileOf(i), tile) << set << ", edge " << edge << ", point " << i;
            const int inside =
                v.x - tile.x * edge + edge * (v.y - tile.y * edge + edge * (v.z - tile.z * edge));
            ASSERT_EQ(positions.cell[i], inside) << set << ", edge " << edge << ", point " << i;
            ASSERT_NEAR(positions.inside[0][i], p.x() / cell - tile.x * edge - 0.5, 1e-5) << set;
            ASSERT_NEAR(positions.inside[2][i], p.z() / cell - tile.z * edge - 0.5, 1e-5) << set;
          }
        }
      }
    }
  }
}

TEST(TileGrid, ClampsPointsTooFarAway) {
  Points points;
  for (const float far : {1e9f, -1e9f, 1e12f, -3e38f, 3e38f}) points.add(far, -far, 1.0f);
  for (const std::string& set : instructionSets()) {
    const PointKernels& kernels = pointKernelsFor(set);
    for (const int edge : {8, 24, 32}) {
      for (const auto locate : {kernels.locate_points, kernels.locate_cells}) {
        TilePositions positions;
        locate(TileGrid(GridGeometry(0.1), {0, 0, 0}, edge), points.span(), points.x.size(), positions);
        for (std::size_t i = 0; i < points.x.size(); ++i) {
          EXPECT_GE(positions.cell[i], 0) << set << ", point " << i;
          EXPECT_LT(positions.cell[i], edge * edge * edge) << set << ", point " << i;
          EXPECT_GT(std::abs(static_cast<double>(positions.tile[0][i])) * edge, 9e8)
              << set << ", point " << i;
        }
      }
    }
  }
}

/// Distance from a point to the nearest voxel centre of a neighbour block [voxels], by testing each.
/// @param offset of the block [blocks].
double distanceTo(const Eigen::Vector3d& from_first_centre, const Eigen::Vector3i& offset) {
  double least = 1e9;
  for (int v = 0; v < kBlockVoxels; ++v) {
    const Eigen::Vector3d centre(v % 8 + 8 * offset.x(), v / 8 % 8 + 8 * offset.y(), v / 64 + 8 * offset.z());
    least = std::min(least, (from_first_centre - centre).norm());
  }
  return least;
}

TEST(TileGrid, FindsTheBlocksThatPointsReach) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> in_block(-0.5f, 7.5f);
  for (const std::string& set : instructionSets()) {
    for (const float reach : {0.87f, 1.0f, 2.3f, 5.0f, 8.0f}) {
      TilePositions positions;
      constexpr std::size_t kCount = 37;
      for (std::size_t i = 0; i < kCount; ++i) {
        for (auto& axis : positions.inside) axis[i] = in_block(random);
      }
      pointKernelsFor(set).reach_blocks(kCount, reach, positions);
      for (std::size_t i = 0; i < kCount; ++i) {
        const Eigen::Vector3d p(positions.inside[0][i], positions.inside[1][i], positions.inside[2][i]);
        for (int code = 0; code < 27; ++code) {
          const double distance = distanceTo(p, {code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1});
          if (std::abs(distance - static_cast<double>(reach)) < 1e-5) continue;  // rounding decides
          EXPECT_EQ(positions.reached[i] >> code & 1, distance < static_cast<double>(reach))
              << set << ", reach " << reach << ", block " << code;
        }
      }
    }
  }
}

}  // namespace
}  // namespace bki_mapping
