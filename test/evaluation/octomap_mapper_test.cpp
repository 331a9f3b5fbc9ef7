// That OctoMap gets the same points in the same voxels, with the settings given.
#include "evaluation/octomap_mapper.h"
#include "refusal_of.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <stdexcept>
#include <tuple>

namespace bki_mapping {
namespace {

TEST(OctomapMapper, HasTheVoxelsOfTheMap) {
  const GridGeometry geometry(0.3);
  OctomapMapper mapper(geometry.resolution());
  Scan scan;
  scan.origin = {0.4, -0.2, 0.1};
  const std::vector<Eigen::Vector3d> hits = {{5.05, 0.1, 0.2}, {-4.1, -3.3, 1.0}, {0.2, 7.7, -0.4}};
  for (const Eigen::Vector3d& hit : hits) scan.points.push_back((hit - scan.origin).cast<float>());
  scan.points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f);
  EXPECT_GT(mapper.integrate(scan).wall, 0.0);
  for (const Eigen::Vector3d& hit : hits) {
    const VoxelIndex voxel = geometry.voxelAt(hit);
    EXPECT_TRUE(mapper.at(voxel)) << hit.transpose();
    EXPECT_FALSE(mapper.at({voxel.x + 1, voxel.y + 1, voxel.z + 1})) << "unknown";
    EXPECT_FALSE(mapper.at(geometry.voxelAt(0.5 * (hit + scan.origin)))) << "crossed";
  }
  EXPECT_GT(mapper.bytes(), 0u);
}

TEST(OctomapMapper, ClearsWhatItCrossesLongEnough) {
  OctomapMapper mapper(1.0);
  Scan near, far;
  near.points = {{5.5f, 0.5f, 0.5f}};
  far.points = {{9.5f, 0.9f, 0.9f}};
  const VoxelIndex voxel{5, 0, 0};
  for (int n = 0; n < 20; ++n) mapper.integrate(near);
  EXPECT_TRUE(mapper.at(voxel));
  int scans = 0;
  for (; mapper.at(voxel) && scans < 100; ++scans) mapper.integrate(far);
  // From the clamped log-odds of 0.97, 3.476, by steps of that of 0.4, -0.405.
  EXPECT_EQ(scans, 9);
}

/// Two hits, 4 and 20 m ahead, in voxels of 1 m.
Scan twoHits() {
  Scan scan;
  scan.origin = {0.5, 0.5, 0.5};
  scan.points = {{4.0f, 0.0f, 0.0f}, {20.0f, 1.0f, 0.0f}};
  return scan;
}

std::string faultOf(const std::string& settings) {
  return refusalOf([&] { octomapSettings(settings); });
}

TEST(OctomapMapper, BeamsBeyondTheLargestRangeOnlyClearUpToIt) {
  OctomapMapper all(1.0), near(1.0, octomapSettings("max_range=10"));
  all.integrate(twoHits());
  near.integrate(twoHits());
  EXPECT_TRUE(all.at({20, 1, 0}));
  EXPECT_EQ(near.occupantOf({20, 1, 0}).state, VoxelState::kUnknown);
  EXPECT_EQ(near.occupantOf({8, 0, 0}).state, VoxelState::kFree);
  EXPECT_EQ(near.occupantOf({13, 1, 0}).state, VoxelState::kUnknown);
  EXPECT_EQ(all.occupantOf({13, 1, 0}).state, VoxelState::kFree);
  EXPECT_TRUE(near.at({4, 0, 0}));
  EXPECT_LT(near.bytes(), all.bytes());
}

TEST(OctomapMapper, SaysTheProbabilitiesThatItsSettingsGive) {
  OctomapMapper mapper(1.0, octomapSettings("hit=0.8,miss=0.3,min=0.25,max=0.9,threshold=0.85"));
  const VoxelIndex hit{4, 0, 0}, crossed{2, 0, 0};
  mapper.integrate(twoHits());
  EXPECT_NEAR(*mapper.occupantOf(hit).occupancy, 0.8, 1e-6);
  EXPECT_NEAR(*mapper.occupantOf(crossed).occupancy, 0.3, 1e-6);
  EXPECT_FALSE(mapper.at(hit)) << "below the threshold";
  for (int n = 0; n < 5; ++n) mapper.integrate(twoHits());
  EXPECT_NEAR(*mapper.occupantOf(hit).occupancy, 0.9, 1e-6);
  EXPECT_NEAR(*mapper.occupantOf(crossed).occupancy, 0.25, 1e-6);
  EXPECT_TRUE(mapper.at(hit));
  EXPECT_FALSE(mapper.occupantOf({4, 5, 0}).occupancy);
}

TEST(OctomapMapper, EachBeamCountsForItselfWithRays) {
  Scan twice = twoHits();
  twice.points.push_back(twice.points[0]);
  OctomapMapper scans(1.0), rays(1.0, octomapSettings("rays=true"));
  scans.integrate(twice);
  rays.integrate(twice);
  const VoxelIndex hit{4, 0, 0};
  EXPECT_NEAR(*scans.occupantOf(hit).occupancy, 0.7, 1e-6);
  EXPECT_NEAR(*rays.occupantOf(hit).occupancy, 0.784, 1e-6) << "two hits, and the beam to the far one";
}

TEST(OctomapMapper, VisitsTheVoxelsOfPrunedLeavesOnce) {
  for (const char* settings : {"default", "lazy=true,compress_map=false", "discretize=true"}) {
    OctomapMapper mapper(0.5, octomapSettings(settings));
    Scan wall;  // crosses a block of voxels densely enough for it to become one leaf
    wall.origin = {0.1, 0.1, 0.1};
    for (int y = -40; y <= 40; ++y) {
      for (int z = -40; z <= 40; ++z)
        wall.points.emplace_back(8.0f, 0.1f * static_cast<float>(y), 0.1f * static_cast<float>(z));
    }
    for (int n = 0; n < 12; ++n) mapper.integrate(wall);
    std::map<std::tuple<int, int, int>, VoxelState> seen;
    std::size_t occupied = 0;
    mapper.forEachKnown([&](const VoxelIndex& v, const Occupant& occupant) {
      EXPECT_TRUE(seen.emplace(std::tuple(v.x, v.y, v.z), occupant.state).second)
          << v.x << " " << v.y << " " << v.z;
      EXPECT_EQ(occupant.state, mapper.occupantOf(v).state);
      EXPECT_EQ(occupant.state == VoxelState::kOccupied, mapper.at(v).has_value());
      occupied += occupant.state == VoxelState::kOccupied;
    });
    EXPECT_GE(occupied, 17u * 17u) << settings;
    for (int x = -2; x < 20; ++x) {
      for (int y = -12; y < 12; ++y) {
        for (int z = -12; z < 12; ++z) {
          const bool known = mapper.occupantOf({x, y, z}).state != VoxelState::kUnknown;
          EXPECT_EQ(seen.count(std::tuple(x, y, z)) == 1, known)
              << settings << " " << x << " " << y << " " << z;
        }
      }
    }
  }
}

TEST(OctomapSettings, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(faultOf("default"), "");
  EXPECT_EQ(faultOf("max_range=-1,lazy=true"), "");
  EXPECT_NE(faultOf("maxrange=10").find("'maxrange' is unknown; did you mean 'max_range'?"),
            std::string::npos);
  EXPECT_NE(faultOf("hit=0.4,miss=0.6").find("hit"), std::string::npos);
  EXPECT_NE(faultOf("hit=0.4,miss=0.6").find("miss"), std::string::npos);
  EXPECT_NE(faultOf("max_range").find("has no '='"), std::string::npos);
  EXPECT_NE(faultOf("").find("no settings"), std::string::npos);
  EXPECT_NE(faultOf("hit=0.7,hit=0.8").find("given twice"), std::string::npos);
  EXPECT_NE(faultOf("min=0.9,max=0.8").find("min must be below"), std::string::npos);
  EXPECT_NE(faultOf("rays=true,max_range=5").find("ignores max_range"), std::string::npos);
}

}  // namespace
}  // namespace bki_mapping
