// The blocks along beams are those that have a voxel centre within reach of a beam, and few others; whatever
// the number of threads, in the same order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "beams/block_walk.h"

namespace bki_mapping {
namespace {

/// The piece of a beam that is walked, from `begin` to `end` as parts of its length.
struct Part {
  double begin = 0.0, end = 1.0;
};

Part partOf(const Eigen::Vector3f& end, const BeamPiece& piece) {
  if (!piece.shadow) return {};
  const double to = piece.shadow_range / end.cast<double>().norm();
  return {std::min(1.0, to), std::max(1.0, to)};
}

/// Distance of a point from a part of the beam from the origin to `end` [m].
double distanceOf(const Eigen::Vector3d& point, const Eigen::Vector3d& origin, const Eigen::Vector3f& end,
                  const Part& part) {
  const Eigen::Vector3d p = point - origin, d = end.cast<double>();
  const double along =
      d.squaredNorm() > 0.0 ? std::clamp(p.dot(d) / d.squaredNorm(), part.begin, part.end) : 0.0;
  return (p - along * d).norm();
}

/// Whether a block has a voxel centre within reach of a beam.
bool isReached(const GridGeometry& geometry, const BlockIndex& block, const Beams& beams, const Part& part,
               double reach) {
  for (int v = 0; v < kBlockVoxels; ++v) {
    const Eigen::Vector3d centre = geometry.voxelCentre(GridGeometry::voxelOf(block, v));
    if (distanceOf(centre, beams.origin, beams.ends[0], part) < reach) return true;
  }
  return false;
}

Beams randomBeams(std::mt19937& random, int count) {
  std::uniform_real_distribution<float> metres(-9.0f, 9.0f);
  Beams beams;
  beams.origin = {0.37, -12.6, 1.7};
  for (int n = 0; n < count; ++n) beams.ends.emplace_back(metres(random), metres(random), metres(random));
  // Along axes and diagonals, where slopes are 0 and 1; without length.
  for (const Eigen::Vector3f& end :
       {Eigen::Vector3f(8, 0, 0), Eigen::Vector3f(0, -8, 0), Eigen::Vector3f(0, 0, 8),
        Eigen::Vector3f(6, 6, 0), Eigen::Vector3f(-5, 5, -5), Eigen::Vector3f(0, 0, 0)}) {
    beams.ends.push_back(end);
  }
  return beams;
}

/// Reaches with which beams extend over two blocks across a slab at most, and with which over more.
TEST(BlockWalk, ListsTheBlocksAlongBeams) {
  std::mt19937 random(5);
  const GridGeometry geometry(0.3);
  for (const BeamPiece& piece : {BeamPiece(), BeamPiece{true, 7.0}}) {
    for (const double reach : {0.05, 0.3, 0.9, 3.0}) {
      const Beams all = randomBeams(random, 20);
      for (const Eigen::Vector3f& end : all.ends) {
        if (piece.shadow && end.norm() < 0.1f) continue;  // casts none
        const Beams beams = {all.origin, {end}};
        const Part part = partOf(end, piece);
        ThreadPool pool(1);
        std::vector<GridIndex> blocks;
        BlockWalk().listBlocksAlong(geometry, beams, piece, reach, 1 << 20, pool, blocks);
        const std::set<GridIndex> listed(blocks.begin(), blocks.end());
        const BlockIndex centre = GridGeometry::blockOf(geometry.voxelAt(all.origin));
        for (int n = 0; n < 15 * 15 * 15; ++n) {
          const BlockIndex block{
              {centre.x + n % 15 - 7, centre.y + n / 15 % 15 - 7, centre.z + n / (15 * 15) - 7}};
          const bool is_listed = listed.count(block) > 0;
          const double distance = distanceOf(geometry.blockCentre(block), beams.origin, end, part);
          if (distance < reach + geometry.blockSize()) {  // others cannot be reached
            EXPECT_TRUE(is_listed || !isReached(geometry, block, beams, part, reach))
                << reach << ", " << end.transpose();
          }
          EXPECT_TRUE(!is_listed || distance < 3.0 * (reach + geometry.blockSize())) << distance;
        }
      }
    }
  }
}

/// Beams so long that there is no memory for a mark of each block around them.
TEST(BlockWalk, ListsTheBlocksAlongVeryLongBeams) {
  const GridGeometry geometry(0.3);
  const Beams beams = {{0.1, 0.2, 0.3}, {{3000.0f, 2900.0f, 2800.0f}, {-3000.0f, 2900.0f, 2800.0f}}};
  ThreadPool pool(1);
  std::vector<GridIndex> blocks;
  BlockWalk().listBlocksAlong(geometry, beams, BeamPiece(), 0.3, 1 << 20, pool, blocks);
  const std::set<GridIndex> listed(blocks.begin(), blocks.end());
  EXPECT_EQ(listed.size(), blocks.size());
  for (const Eigen::Vector3f& end : beams.ends) {
    for (double part = 0.0; part <= 1.0; part += 1e-4) {
      const Eigen::Vector3d point = beams.origin + part * end.cast<double>();
      ASSERT_EQ(listed.count(GridGeometry::blockOf(geometry.voxelAt(point))), 1u) << point.transpose();
    }
  }
  for (const GridIndex& block : listed) {
    const Eigen::Vector3d centre = geometry.blockCentre({block});
    EXPECT_LT(std::min(distanceOf(centre, beams.origin, beams.ends[0], {}),
                       distanceOf(centre, beams.origin, beams.ends[1], {})),
              3.0 * (0.3 + geometry.blockSize()));
  }
  EXPECT_THROW(BlockWalk().listBlocksAlong(geometry, beams, BeamPiece(), 0.3, 100, pool, blocks),
               TooMuchWork);
}

TEST(BlockWalk, DoesNotDependOnThreads) {
  std::mt19937 random(6);
  const GridGeometry geometry(0.1);
  const Beams beams = randomBeams(random, 5000);
  for (const double reach : {0.1, 0.3}) {
    std::vector<GridIndex> expected;
    for (const int threads : {1, 2, 5}) {
      ThreadPool pool(threads);
      std::vector<GridIndex> listed;
      BlockWalk walk;
      for (int scan = 0; scan < 2; ++scan) {  // marks of the scan before are gone
        listed.clear();
        walk.listBlocksAlong(geometry, beams, BeamPiece(), reach, 1 << 20, pool, listed);
      }
      if (threads == 1) expected = listed;
      EXPECT_EQ(listed, expected) << threads;
    }
    EXPECT_GT(expected.size(), 1000u);
  }
}

/// Beams of a lidar: some rows, side by side, ending where chance has it.
Beams denseBeams(std::mt19937& random) {
  std::uniform_real_distribution<float> metres(1.0f, 40.0f), slope(-0.001f, 0.001f);
  Beams beams;
  beams.origin = {-3.2, 5.1, 1.7};
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 400; ++column) {
      const float azimuth = 0.016f * static_cast<float>(column), z = 0.02f * static_cast<float>(row - 6);
      const Eigen::Vector3f along(std::cos(azimuth), std::sin(azimuth), z + slope(random));
      beams.ends.push_back(along * metres(random));
    }
  }
  return beams;
}

/// Blocks of beams that are walked together are those of each of them, and hardly more.
TEST(BlockWalk, ListsEachBlockOfAnyBeamOnce) {
  std::mt19937 random(7);
  const GridGeometry geometry(0.3);
  ThreadPool pool(2);
  BlockWalk walk;
  for (const Beams& beams : {randomBeams(random, 300), denseBeams(random)}) {
    for (const BeamPiece& piece : {BeamPiece(), BeamPiece{true, 25.0}}) {
      std::vector<GridIndex> together, one_by_one;
      const auto list = [&](const Beams& of, std::vector<GridIndex>& to) {
        walk.listBlocksAlong(geometry, of, piece, 0.3, 1 << 20, pool, to);
      };
      Beams some = beams;
      if (piece.shadow) {  // others cast none
        const auto end = std::remove_if(some.ends.begin(), some.ends.end(),
                                        [](const Eigen::Vector3f& e) { return e.norm() < 0.1f; });
        some.ends.erase(end, some.ends.end());
      }
      list(some, together);
      for (const Eigen::Vector3f& end : some.ends) list({some.origin, {end}}, one_by_one);
      const std::set<GridIndex> expected(one_by_one.begin(), one_by_one.end()),
          listed(together.begin(), together.end());
      EXPECT_TRUE(std::includes(listed.begin(), listed.end(), expected.begin(), expected.end()));
      EXPECT_EQ(together.size(), listed.size());
      EXPECT_GT(expected.size(), 400u);
      EXPECT_LT(listed.size(), expected.size() + expected.size() / 10);
    }
  }
}

TEST(BlockWalk, RefusesMoreBlocksThanItMayList) {
  std::mt19937 random(8);
  const GridGeometry geometry(0.3);
  const Beams beams = randomBeams(random, 300);
  ThreadPool pool(2);
  BlockWalk walk;
  std::vector<GridIndex> together;
  walk.listBlocksAlong(geometry, beams, BeamPiece(), 0.3, 1 << 20, pool, together);
  std::vector<GridIndex> too_many;
  EXPECT_THROW(walk.listBlocksAlong(geometry, beams, BeamPiece(), 0.3, together.size() - 1, pool, too_many),
               TooMuchWork);
}

}  // namespace
}  // namespace bki_mapping
