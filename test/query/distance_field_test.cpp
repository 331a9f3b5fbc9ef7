// Distance fields equal the distances to all obstacles, one by one, and updated ones equal new ones.
#include "bki_mapping/query/distance_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "query/distance_kernels.h"
#include "query/query_map.h"
#include "simd/instruction_sets.h"

namespace bki_mapping {
namespace {

bool isObstacle(const SemanticMap& map, const VoxelIndex& voxel, const ObstacleRules& rules) {
  const VoxelView view = viewWithoutEntropy(map, queryRules(), voxel);
  if (view.state == VoxelState::kOccupied) return rules.classes.contains(view.label);
  return rules.unknown && view.state != VoxelState::kFree;
}

/// The voxels of a field's region, in the order of distances().
std::vector<VoxelIndex> voxelsOf(const DistanceField& field) {
  std::vector<VoxelIndex> voxels;
  for (int z = 0; z < field.size().z(); ++z) {
    for (int y = 0; y < field.size().y(); ++y) {
      for (int x = 0; x < field.size().x(); ++x) {
        voxels.push_back({{field.min().x + x, field.min().y + y, field.min().z + z}});
      }
    }
  }
  return voxels;
}

double squaredDistance(const GridIndex& a, const GridIndex& b) {
  const double x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;  // std::pow would take most of the test's time
  return x * x + y * y + z * z;
}

/// Every distance from every obstacle and every other voxel, one by one.
void expectBruteForce(const SemanticMap& map, const DistanceField& field) {
  const std::vector<VoxelIndex> voxels = voxelsOf(field);
  ASSERT_EQ(field.distances().size(), voxels.size());
  std::vector<VoxelIndex> obstacles, others;
  std::vector<bool> is_obstacle;
  for (const VoxelIndex& voxel : voxels) {
    is_obstacle.push_back(isObstacle(map, voxel, field.rules()));
    (is_obstacle.back() ? obstacles : others).push_back(voxel);
  }
  const double resolution = map.geometry().resolution();
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    double nearest = kInfinity;
    for (const VoxelIndex& other : is_obstacle[n] ? others : obstacles) {
      nearest = std::min(nearest, squaredDistance(voxels[n], other));
    }
    const double distance = resolution * std::sqrt(nearest);
    const auto expected = static_cast<float>(is_obstacle[n] ? resolution - distance : distance);
    ASSERT_FLOAT_EQ(field.distances()[n], expected) << n;
    ASSERT_EQ(field.distance(voxels[n]), field.distances()[n]);
    ASSERT_TRUE(field.contains(voxels[n]));
  }
}

Eigen::AlignedBox3d boxOf(double x, double y, double z, double size_x, double size_y, double size_z) {
  return {Eigen::Vector3d(x, y, z), Eigen::Vector3d(x + size_x, y + size_y, z + size_z)};
}

std::vector<float> copyOf(const DistanceField& field) {
  return {field.distances().begin(), field.distances().end()};
}

TEST(DistanceField, EqualsBruteForce) {
  for (const double occupied : {0.1, 0.002}) {
    QueryMapKind kind;
    kind.occupied = occupied;
    const SemanticMap map = queryMap(41, kind);
    const StateMap states(map, queryRules(), 2);
    for (const Eigen::AlignedBox3d& box :
         {boxOf(-3.1, -2.3, -1.2, 7.6, 4.7, 1.9), boxOf(-1, -6, -4, 1.3, 7.1, 6.2),
          boxOf(0, 0, 0, 4, 0.1, 0.1), boxOf(1, 2, -3, 0.1, 3, 0.1), boxOf(-5, -5, -5, 0.1, 0.1, 6),
          boxOf(5, 5, 5, 4.4, 4.3, 4.2)}) {
      expectBruteForce(map, DistanceField(states, box));
      expectBruteForce(map, DistanceField(states, box, {ClassFilter::allBut({3, 7}), false}));
      expectBruteForce(map, DistanceField(states, box, {{7}, true}));
    }
  }
}

TEST(DistanceField, OfAnotherBoxEqualsANewOne) {
  const SemanticMap map = queryMap(49);
  const StateMap states(map, queryRules(), 2);
  DistanceField field(states, boxOf(-2, -3, -2, 3, 4, 3));
  for (const Eigen::AlignedBox3d& box :
       {boxOf(-1, -3, 0, 2, 2, 2), boxOf(-4, -3, -2, 7, 6, 5), boxOf(0, 0, 0, 0.1, 5, 2)}) {
    field.compute(states, box);
    ASSERT_EQ(copyOf(field), copyOf(DistanceField(states, box)));
  }
  const std::vector<float> before = copyOf(field);
  EXPECT_THROW(field.compute(states, boxOf(0, 0, 0, 300, 300, 300)), std::invalid_argument);
  EXPECT_EQ(copyOf(field), before);
}

TEST(DistanceField, IsInfiniteWithoutObstaclesAndWithNothingElse) {
  const SemanticMap map = queryMap(42);
  const StateMap states(map, queryRules());
  const Eigen::AlignedBox3d box = boxOf(-2, -2, -2, 3, 3, 3);
  const DistanceField none(states, box, {{}, false});
  for (const float distance : none.distances()) ASSERT_EQ(distance, static_cast<float>(kInfinity));
  const DistanceField outside(states, boxOf(100, 100, 100, 3, 3, 3), {{}, true});
  for (const float distance : outside.distances()) ASSERT_EQ(distance, static_cast<float>(-kInfinity));
  const auto value = none.interpolate({-1, -1, -1});
  ASSERT_TRUE(value);
  EXPECT_EQ(value->distance, static_cast<float>(kInfinity));
  EXPECT_TRUE(value->gradient.isZero());
}

/// A line of two obstacles far apart: distances in the thousands.
TEST(DistanceField, IsExactFarAway) {
  SemanticMap map(GridGeometry(0.5), 0.001, 3);
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  plane[0] = unitsOf(1.0);
  map.getOrAllocate({{0, 0, 0}}).add(2, plane.data());
  const StateMap states(map, queryRules(), 2);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::AlignedBox3d box = boxOf(-0.9, -0.9, -0.9, 2, 2, 2);
    box.max()[axis] = 4000.0;
    const DistanceField field(states, box);
    for (const int far : {1, 100, 4095, 7998}) {
      VoxelIndex voxel = {{1, 1, 1}};
      (axis == 0 ? voxel.x : axis == 1 ? voxel.y : voxel.z) = far;
      ASSERT_FLOAT_EQ(field.distance(voxel), static_cast<float>(0.5 * std::sqrt(2.0 + double(far) * far)));
    }
  }
}

/// The loops of each instruction set, on numbers of all sizes and signs.
TEST(DistanceKernels, AreTheSameOnAllInstructionSets) {
  std::mt19937 random(43);
  const std::string name = "generic";
  const DistanceKernels& generic = distanceKernelsFor(name);
  for (const std::string& set : instructionSets()) {
    const DistanceKernels& kernels = distanceKernelsFor(set);
    for (const std::size_t width : {1u, 15u, 16u, 37u, 200u}) {
      for (const unsigned rare : {2u, 30u, 10000u}) {
        std::vector<std::int32_t> squares(wholeChunks(width));
        for (std::int32_t& square : squares) {
          square = random() % rare == 0 ? 1 : random() % 5 == 0 ? kNone : int(random() % 3000) + 1;
          if (random() % rare == 0) square = -square;
        }
        std::vector<std::int32_t> scratch(rowScratch(width)), a(squares.size()), b(squares.size());
        generic.searchRow(squares.data(), width, scratch.data(), a.data());
        kernels.searchRow(squares.data(), width, scratch.data(), b.data());
        a.resize(width);
        b.resize(width);
        ASSERT_EQ(a, b) << set;
        for (std::size_t x = 0; x < width; ++x) {
          std::int64_t least = kNone;
          for (std::size_t from = 0; from < width; ++from) {
            const std::int64_t apart = std::int64_t(from) - std::int64_t(x);
            const std::int64_t square = squares[x] > 0 ? squares[from] : -squares[from];
            least = std::min(least, std::max<std::int64_t>(square, 0) + apart * apart);
          }
          ASSERT_EQ(a[x], squares[x] > 0 ? least : -least);
        }
        std::vector<std::int32_t> plane(kChunk * width);
        for (std::int32_t& kind : plane) kind = random() % rare == 0 ? -1 : 1;
        std::vector<std::int32_t> c = plane, d = plane;
        generic.sweepColumns(c.data(), kChunk, width);
        kernels.sweepColumns(d.data(), kChunk, width);
        ASSERT_EQ(c, d) << set;
        std::vector<std::int32_t> columns(columnScratch(width));
        std::vector<float> e(c.size()), f(c.size());
        generic.searchColumns(c.data(), kChunk, width, 0.3f, columns.data(), e.data());
        kernels.searchColumns(c.data(), kChunk, width, 0.3f, columns.data(), f.data());
        ASSERT_EQ(e, f) << set;
      }
    }
  }
}

TEST(DistanceField, UpdatedEqualsNew) {
  SemanticMap map = queryMap(44);
  const Eigen::AlignedBox3d box = boxOf(-3.9, -5.1, -2.2, 9.1, 8.3, 5.0);
  for (const ObstacleRules& rules : {ObstacleRules{}, ObstacleRules{{3}, true}}) {
    std::mt19937 random(45);
    const StateMap before(map, queryRules(), 2);
    DistanceField field(before, box, rules);
    for (int round = 0; round < 12; ++round) {
      std::vector<GridIndex> changed;
      for (int n = 0; n < (round % 3 == 0 ? 1 : 10); ++n) {
        const auto coordinate = [&] { return int(random() % 8) - 4; };
        const BlockIndex index = {{coordinate(), coordinate(), coordinate()}};
        changed.push_back(index);
        if (random() % 4 == 0) {
          map.erase(index);
          continue;
        }
        std::vector<EvidenceUnits> plane(kBlockVoxels);
        plane[random() % kBlockVoxels] = unitsOf(50.0);
        map.getOrAllocate(index).add(random() % 2 == 0 ? ClassId{3} : kFreeClass, plane.data());
      }
      const SemanticMap snapshot = map.snapshot();
      const StateMap states(snapshot, queryRules(), 2);
      field.update(states, changed);
      ASSERT_EQ(copyOf(field), copyOf(DistanceField(states, box, rules))) << round;
    }
    field.update(before, {});
    const SemanticMap other(GridGeometry(0.3), 0.001, 3);
    EXPECT_THROW(field.update(StateMap(other, queryRules()), {}), std::invalid_argument);
  }
}

TEST(DistanceField, InterpolatesBetweenCentres) {
  QueryMapKind kind;
  kind.occupied = 0.01;
  const SemanticMap map = queryMap(46, kind);
  const StateMap states(map, queryRules());
  const DistanceField field(states, boxOf(-3, -3, -3, 6, 6, 6));
  for (const VoxelIndex& voxel : voxelsOf(field)) {
    const auto value = field.interpolate(map.geometry().voxelCentre(voxel));
    ASSERT_TRUE(value);
    ASSERT_NEAR(value->distance, field.distance(voxel), 1e-5);
  }
  std::mt19937 random(47);
  std::uniform_real_distribution<double> coordinate(-2.85, 2.85);
  for (int n = 0; n < 1000; ++n) {
    const Eigen::Vector3d point(coordinate(random), coordinate(random), coordinate(random));
    const auto value = field.interpolate(point);
    ASSERT_TRUE(value);
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kStep = 1e-4;
      const auto before = field.interpolate(point - kStep * Eigen::Vector3d::Unit(axis)),
                 after = field.interpolate(point + kStep * Eigen::Vector3d::Unit(axis));
      const double slope = double(after->distance - before->distance) / (2 * kStep);
      // A kink between two centres may lie within the step; there the slopes at its ends enclose it.
      const double low = double(std::min(before->gradient[axis], after->gradient[axis])),
                   high = double(std::max(before->gradient[axis], after->gradient[axis]));
      ASSERT_GT(slope, low - 0.02) << point.transpose();
      ASSERT_LT(slope, high + 0.02) << point.transpose();
    }
  }
  EXPECT_TRUE(field.interpolate({-3, 3, 3})) << "the region's corners are in it";
  EXPECT_FALSE(field.interpolate({-3.01, 0, 0}));
  EXPECT_FALSE(field.interpolate({0, std::numeric_limits<double>::quiet_NaN(), 0}));
}

TEST(DistanceField, RefusesImpossibleRegions) {
  const SemanticMap map = queryMap(48);
  const StateMap states(map, queryRules());
  expectRefused("the region is inside out; give a min below its max",
                [&] { DistanceField(states, boxOf(0, 0, 0, -1, 1, 1)); });
  expectRefused("the region has a coordinate that is not finite; give finite ones",
                [&] { DistanceField(states, boxOf(0, 0, 0, 1, kInfinity, 1)); });
  expectRefused("the region reaches beyond the map's grid; cut it to where the map is",
                [&] { DistanceField(states, boxOf(0, 0, 0, 1e10, 1, 1)); });
  expectRefused(
      "the region has 1000 x 1000 x 1000 voxels; make it smaller, 100 million and 16384 along an axis are "
      "the most",
      [&] { DistanceField(states, boxOf(0, 0, 0, 250, 250, 250)); });
  expectRefused(
      "the region has 4 x 20000 x 4 voxels; make it smaller, 100 million and 16384 along an axis are the "
      "most",
      [&] { DistanceField(states, boxOf(0, 0, 0, 1, 5000, 1)); });
}

}  // namespace
}  // namespace bki_mapping
