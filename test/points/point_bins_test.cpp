// Points are stored in exactly the blocks that they reach, for kernels of any length and points in any order.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "points/point_bins.h"

namespace bki_mapping {
namespace {

constexpr double kResolution = 0.3;
const Eigen::Vector3d kOrigin(0.7, -12.3, 1.1);

LabelledPoints randomPoints(std::size_t count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> anywhere(-6.0f, 6.0f);
  LabelledPoints points;
  for (std::size_t i = 0; i < count; ++i) {
    points.points.emplace_back(anywhere(random), anywhere(random), anywhere(random));
    points.labels.push_back(static_cast<ClassId>(random() % 5));
  }
  return points;
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
  /// @param tile edge of the down-sampler's tiles [m], which need not be blocks.
  Bins(double length, bool keep_containing, const LabelledPoints& points, double tile)
      : downsampler_(0.0, tile),
        bins_(GridGeometry(kResolution), VoxelKernel(kernelOf(length), kResolution), pointKernelsFor("")) {
    for (int time = 0; time < 2; ++time) {  // the second time reuses the memory of the first
      downsampler_.start(kOrigin, 1, pool_, false);
      Downsampler::Input& input = downsampler_.open(0, 0);
      for (std::size_t i = 0; i < points.points.size(); ++i) input.add(points.points[i], points.labels[i]);
      downsampler_.close(0, 0);
      downsampler_.finish(pool_);
      bins_.setPoints(kOrigin, downsampler_, keep_containing, pool_);
    }
  }
  const PointBins& bins() const { return bins_; }

 private:
  ThreadPool pool_{2};
  Downsampler downsampler_;
  PointBins bins_;
};

constexpr double kBlock = kBlockEdge * kResolution;

TEST(PointBins, HoldsEachPointInTheBlocksThatItReaches) {
  const LabelledPoints points = randomPoints(300);
  for (const double length : {0.05, 0.2, 0.3, 0.7, 2.39, 3.1}) {
    std::multiset<GridIndex> expected;
    for (const Eigen::Vector3f& p : points.points) {
      for (const GridIndex& block : blocksReached(kOrigin + p.cast<double>(), length)) expected.insert(block);
    }
    for (const double tile : {kBlock, 1.7, 100.0}) {
      const Bins made(length, false, points, tile);
      const PointBins& bins = made.bins();
      std::multiset<GridIndex> found;
      for (std::size_t b = 0; b < bins.blocks().size(); ++b) {
        for (const PointRun* run = bins.begin(b); run != bins.end(b); ++run) {
          for (std::size_t i = 0; i < run->count; ++i) found.insert(bins.blocks().members()[b]);
        }
      }
      EXPECT_EQ(found, expected) << "length " << length << ", tile " << tile;
      EXPECT_FALSE(bins.oneClass());
    }
  }
}

TEST(PointBins, KeepsPointsInTheirContainingBlocks) {
  const LabelledPoints points = randomPoints(300);
  const GridGeometry geometry(kResolution);
  const Bins made(0.05, true, points, kBlock);  // most points reach no centre
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
        const auto same = [&](const Eigen::Vector3f& p) {
          return (kOrigin + p.cast<double>() - at).norm() < 1e-5;
        };
        const auto point = std::find_if(points.points.begin(), points.points.end(), same);
        ASSERT_NE(point, points.points.end());
        EXPECT_EQ(points.labels[static_cast<std::size_t>(point - points.points.begin())], local.label);
        const VoxelIndex voxel = geometry.voxelAt(at);
        EXPECT_EQ(local.voxel, GridGeometry::offsetInBlock(voxel));
        EXPECT_EQ(GridGeometry::blockOf(voxel), block);
      }
    }
  }
  EXPECT_EQ(found, points.points.size());
}

TEST(PointBins, KnowsPointsOfOneClass) {
  LabelledPoints points = randomPoints(2000);
  std::fill(points.labels.begin(), points.labels.end(), ClassId{3});
  EXPECT_TRUE(Bins(0.3, false, points, kBlock).bins().oneClass());
  points.labels.back() = 4;
  EXPECT_FALSE(Bins(0.3, false, points, kBlock).bins().oneClass());
}

}  // namespace
}  // namespace bki_mapping
