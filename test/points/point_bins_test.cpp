// Points are stored in exactly the blocks that they reach, for kernels of any length and points in any order.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "points/point_bins.h"

namespace bki_mapping {
namespace {

constexpr double kResolution = 0.3;
const Eigen::Vector3d kOrigin(0.7, -12.3, 1.1);

struct Point {
  Eigen::Vector3f at;  ///< from kOrigin [m]
  ClassId label;
  float weight;  ///< different for each point
};

std::vector<Point> randomPoints(std::size_t count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> anywhere(-6.0f, 6.0f);
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f at(anywhere(random), anywhere(random), anywhere(random));
    points.push_back({at, static_cast<ClassId>(random() % 5), 0.5f + static_cast<float>(i)});
  }
  return points;
}

/// Deals points to groups in turn.
std::vector<MergedPoints> dealt(const std::vector<Point>& points, std::size_t groups, bool weighted) {
  std::vector<MergedPoints> dealt(groups);
  for (std::size_t i = 0; i < points.size(); ++i) {
    MergedPoints& group = dealt[i % groups];
    group.x.push_back(points[i].at.x());
    group.y.push_back(points[i].at.y());
    group.z.push_back(points[i].at.z());
    group.labels.push_back(points[i].label);
    if (weighted) group.weights.push_back(points[i].weight);
  }
  return dealt;
}

/// The blocks that have a voxel centre within `length` [m] of a point, by a search over all voxels.
std::set<GridIndex> blocksReached(const Eigen::Vector3d& point, double length) {
  const GridGeometry geometry(kResolution);
  const VoxelIndex centre = geometry.voxelAt(point);
  const int reach = static_cast<int>(length / kResolution) + 2;
  std::set<GridIndex> blocks;
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const VoxelIndex voxel{{centre.x + x, centre.y + y, centre.z + z}};
        if ((geometry.voxelCentre(voxel) - point).norm() < length)
          blocks.insert(GridGeometry::blockOf(voxel));
      }
    }
  }
  return blocks;
}

KernelConfig kernelOf(double length) {
  KernelConfig config;
  config.length = length;
  return config;
}

class Bins {
 public:
  Bins(double length, bool keep_containing, const std::vector<Point>& points, std::size_t groups = 1,
       bool weighted = false, const ClassSet& confined = {})
      : groups_(dealt(points, groups, weighted)),
        bins_(GridGeometry(kResolution), VoxelKernel(kernelOf(length), kResolution), pointKernelsFor(""),
              confined) {
    PointGroups all;
    for (const MergedPoints& group : groups_) all.push_back(&group);
    for (int time = 0; time < 2; ++time) {  // the second time reuses the memory of the first
      bins_.setPoints(kOrigin, all, keep_containing, pool_);
    }
  }
  const PointBins& bins() const { return bins_; }

 private:
  ThreadPool pool_{2};
  std::vector<MergedPoints> groups_;
  PointBins bins_;
};

TEST(PointBins, HoldsEachPointInTheBlocksThatItReaches) {
  const std::vector<Point> points = randomPoints(300);
  for (const double length : {0.05, 0.2, 0.3, 0.7, 2.39, 3.1}) {
    std::multiset<GridIndex> expected;
    for (const Point& p : points) {
      for (const GridIndex& block : blocksReached(kOrigin + p.at.cast<double>(), length))
        expected.insert(block);
    }
    for (const std::size_t groups : {1, 7, 64}) {
      const Bins made(length, false, points, groups);
      const PointBins& bins = made.bins();
      std::multiset<GridIndex> found;
      for (std::size_t b = 0; b < bins.blocks().size(); ++b) {
        for (const PointRun* run = bins.begin(b); run != bins.end(b); ++run) {
          for (std::size_t i = 0; i < run->count; ++i) found.insert(bins.blocks().members()[b]);
        }
      }
      EXPECT_EQ(found, expected) << "length " << length << ", groups " << groups;
      EXPECT_FALSE(bins.oneClass());
    }
  }
}

TEST(PointBins, KeepsPointsInTheirContainingBlocks) {
  const std::vector<Point> points = randomPoints(300);
  const GridGeometry geometry(kResolution);
  const Bins made(0.05, true, points);  // most points reach no centre
  const PointBins& bins = made.bins();
  std::size_t found = 0;
  for (std::size_t b = 0; b < bins.blocks().size(); ++b) {
    const BlockIndex block{bins.blocks().members()[b]};
    for (const PointRun* run = bins.begin(b); run != bins.end(b); ++run) {
      for (std::size_t i = 0; i < run->count; ++i, ++found) {
        const LocalPoint& local = run->points[i];
        const Eigen::Vector3d at = geometry.blockOrigin(block) +
                                   kResolution * (Eigen::Vector3f(local.x, local.y, local.z).cast<double>() +
                                                  Eigen::Vector3d::Constant(0.5));
        const auto same = [&](const Point& p) { return (kOrigin + p.at.cast<double>() - at).norm() < 1e-5; };
        const auto point = std::find_if(points.begin(), points.end(), same);
        ASSERT_NE(point, points.end());
        EXPECT_EQ(point->label, local.label);
        const VoxelIndex voxel = geometry.voxelAt(at);
        EXPECT_EQ(local.voxel, GridGeometry::offsetInBlock(voxel));
        EXPECT_EQ(GridGeometry::blockOf(voxel), block);
      }
    }
  }
  EXPECT_EQ(found, points.size());
}

TEST(PointBins, KeepsPointsOfConfinedClassesInTheirContainingBlocksOnly) {
  const std::vector<Point> points = randomPoints(300);
  const ClassId confined = points[0].label;
  for (const double length : {0.05, 0.3, 3.1}) {
    std::multiset<GridIndex> expected;
    for (const Point& p : points) {
      if (p.label == confined) {
        const VoxelIndex voxel = GridGeometry(kResolution).voxelAt(kOrigin + p.at.cast<double>());
        expected.insert(GridGeometry::blockOf(voxel));
        continue;
      }
      for (const GridIndex& block : blocksReached(kOrigin + p.at.cast<double>(), length))
        expected.insert(block);
    }
    const Bins made(length, false, points, 7, false, ClassSet().set(confined));
    std::multiset<GridIndex> found;
    for (std::size_t b = 0; b < made.bins().blocks().size(); ++b) {
      for (const PointRun* run = made.bins().begin(b); run != made.bins().end(b); ++run) {
        for (std::size_t i = 0; i < run->count; ++i) found.insert(made.bins().blocks().members()[b]);
      }
    }
    EXPECT_EQ(found, expected) << "length " << length;
  }
}

TEST(PointBins, KeepsEachWeightWithItsPoint) {
  const std::vector<Point> points = randomPoints(300);
  for (const double length : {0.2, 0.3, 3.1}) {
    const Bins made(length, true, points, 7, true);
    const PointBins& bins = made.bins();
    ASSERT_TRUE(bins.weighted());
    std::set<float> found;
    for (std::size_t b = 0; b < bins.blocks().size(); ++b) {
      const Eigen::Vector3d first = GridGeometry(kResolution).blockOrigin({bins.blocks().members()[b]});
      for (const PointRun* run = bins.begin(b); run != bins.end(b); ++run) {
        ASSERT_NE(run->weights, nullptr);
        for (std::size_t i = 0; i < run->count; ++i) {
          const LocalPoint& local = run->points[i];
          const Point& point = points.at(static_cast<std::size_t>(run->weights[i]));
          const Eigen::Vector3d at = first + kResolution * (Eigen::Vector3d(static_cast<double>(local.x),
                                                                            static_cast<double>(local.y),
                                                                            static_cast<double>(local.z)) +
                                                            Eigen::Vector3d::Constant(0.5));
          EXPECT_LT((kOrigin + point.at.cast<double>() - at).norm(), 1e-5);
          EXPECT_EQ(point.label, local.label);
          found.insert(run->weights[i]);
        }
      }
    }
    EXPECT_EQ(found.size(), points.size());
  }
  EXPECT_FALSE(Bins(0.3, false, points).bins().weighted());
}

TEST(PointBins, KnowsPointsOfOneClass) {
  std::vector<Point> points = randomPoints(2000);
  for (Point& point : points) point.label = 3;
  EXPECT_TRUE(Bins(0.3, false, points, 7).bins().oneClass());
  points.back().label = 4;
  EXPECT_FALSE(Bins(0.3, false, points, 7).bins().oneClass());
}

}  // namespace
}  // namespace bki_mapping
