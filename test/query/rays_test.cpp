// Rays meet the voxels whose boxes they cross, found here by looking at every voxel.
#include "bki_mapping/query/queries.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>

#include "query/query_map.h"
#include "query/ray_walk.h"
#include "refusal_of.h"

namespace bki_mapping {
namespace {

/// Part of a ray, in units of its direction.
struct Part {
  double begin, end;
};

/// The part of a ray in a voxel, which contains its lower faces. @param origin, direction [voxels].
Part partIn(const VoxelIndex& voxel, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d low(voxel.x, voxel.y, voxel.z);
  Part part = {0.0, kInfinity};
  for (int a = 0; a < 3; ++a) {
    const double to_low = low[a] - origin[a], to_high = to_low + 1.0;
    if (direction[a] == 0.0) {
      if (to_low > 0.0 || to_high <= 0.0) return {0.0, -1.0};
    } else {
      part.begin = std::max(part.begin, std::min(to_low / direction[a], to_high / direction[a]));
      part.end = std::min(part.end, std::max(to_low / direction[a], to_high / direction[a]));
    }
  }
  return part;
}

struct Crossed {
  VoxelIndex voxel;
  Part part;
};

/// All voxels near the origin of which a ray crosses more than `least`, in the order in which it does.
std::vector<Crossed> crossedBy(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double length,
                               double least) {
  const Eigen::Vector3d end = origin + length * direction;
  const Eigen::Vector3d low = origin.cwiseMin(end).array().floor() - 1.0,
                        high = origin.cwiseMax(end).array().floor() + 1.0;
  std::vector<Crossed> crossed;
  for (int z = int(low.z()); z <= int(high.z()); ++z) {
    for (int y = int(low.y()); y <= int(high.y()); ++y) {
      for (int x = int(low.x()); x <= int(high.x()); ++x) {
        const VoxelIndex voxel = {{x, y, z}};
        Part part = partIn(voxel, origin, direction);
        part.end = std::min(part.end, length);
        if (part.end - part.begin > least) crossed.push_back({voxel, part});
      }
    }
  }
  std::sort(crossed.begin(), crossed.end(),
            [](const auto& a, const auto& b) { return a.part.begin < b.part.begin; });
  return crossed;
}

std::vector<Crossed> walked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double length) {
  RayWalk walk(origin, direction);
  std::vector<Crossed> voxels;
  while (voxels.empty() || walk.entered() < length) {
    voxels.push_back({walk.voxel(), {walk.entered(), length}});
    if (voxels.size() > 1) voxels[voxels.size() - 2].part.end = walk.entered();
    walk.step(0);
  }
  return voxels;
}

void expectSame(const std::vector<Crossed>& a, const std::vector<Crossed>& b, const std::string& where) {
  ASSERT_EQ(a.size(), b.size()) << where;
  for (std::size_t n = 0; n < a.size(); ++n) {
    ASSERT_EQ(a[n].voxel, b[n].voxel) << where << ", voxel " << n;
    ASSERT_EQ(a[n].part.begin, b[n].part.begin) << where << ", voxel " << n;
  }
}

std::string nameOf(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  std::ostringstream text;
  text << "from " << origin.transpose() << " towards " << direction.transpose();
  return text.str();
}

/// Rays from quarters of voxels in directions of small numbers: along axes, within faces, through edges and
/// corners. All of it is exact.
TEST(RayWalk, OnALatticeIsExact) {
  std::mt19937 random(1);
  for (int n = 0; n < 6000; ++n) {
    const auto quarter = [&] { return (int(random() % 49) - 24) / 4.0; };
    const auto slope = [&] { return n % 3 == 0 ? int(random() % 3) - 1 : int(random() % 11) - 5; };
    const Eigen::Vector3d origin(quarter(), quarter(), quarter());
    Eigen::Vector3d direction(slope(), slope(), slope());
    if (direction.isZero()) direction.x() = -1;
    const double length = 9.0 / direction.cwiseAbs().maxCoeff();
    expectSame(walked(origin, direction, length), crossedBy(origin, direction, length, 0.0),
               nameOf(origin, direction));
  }
}

TEST(RayWalk, AnywhereMeetsAllButWhatItTouches) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (int n = 0; n < 3000; ++n) {
    const double far = n % 3 == 0 ? 1e8 : 10.0;
    const Eigen::Vector3d origin(far * normal(random) * 0.2, normal(random), far * normal(random) * 0.2);
    Eigen::Vector3d direction(normal(random), normal(random), normal(random));
    if (n % 5 == 0) direction[n % 3] *= 1e-9;
    direction /= direction.cwiseAbs().maxCoeff();
    std::map<GridIndex, double> met;
    for (const Crossed& crossed : walked(origin, direction, 12.0)) {
      ASSERT_TRUE(met.emplace(crossed.voxel, crossed.part.begin).second) << nameOf(origin, direction);
      const Part part = partIn(crossed.voxel, origin, direction);
      ASSERT_GE(part.end - part.begin, -1e-12) << nameOf(origin, direction);
    }
    for (const Crossed& crossed : crossedBy(origin, direction, 12.0, 1e-12)) {
      ASSERT_TRUE(met.count(crossed.voxel)) << nameOf(origin, direction);
      ASSERT_NEAR(met[crossed.voxel], crossed.part.begin, 1e-12);
    }
  }
}

/// Steps over cubes of voxels end where single steps do, to the bit.
TEST(RayWalk, LargeStepsMeetTheVoxelsOfSmallOnes) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int n = 0; n < 3000; ++n) {
    Eigen::Vector3d origin(50 * normal(random), 50 * normal(random), 50 * normal(random)),
        direction(normal(random), normal(random), normal(random));
    if (n % 2 == 0) {
      origin = (origin * 4).array().round() / 4;
      direction = (direction * 2).array().round();
    }
    if (direction.isZero()) direction.z() = 1;
    const std::vector<Crossed> steps = walked(origin, direction, 100.0 / direction.cwiseAbs().maxCoeff());
    RayWalk walk(origin, direction);
    for (std::size_t s = 0; s < steps.size(); ++s) {
      ASSERT_EQ(walk.voxel(), steps[s].voxel) << nameOf(origin, direction);
      ASSERT_EQ(walk.entered(), steps[s].part.begin) << nameOf(origin, direction);
      const int shift = int(random() % 7);
      const auto cubeOf = [shift](const VoxelIndex& v) {
        return GridIndex{v.x >> shift, v.y >> shift, v.z >> shift};
      };
      const GridIndex cube = cubeOf(walk.voxel());
      while (s + 1 < steps.size() && cubeOf(steps[s + 1].voxel) == cube) ++s;
      walk.leave(shift);
    }
    const std::size_t middle = steps.size() / 2;
    RayWalk skipping(origin, direction);
    skipping.skipTo(0.5 * (steps[middle].part.begin + steps[middle].part.end));
    ASSERT_EQ(skipping.voxel(), steps[middle].voxel) << nameOf(origin, direction);
  }
}

/// What a ray meets, voxel by voxel; from voxels that it crosses for more than `least`.
RayHit slowlyCast(const SemanticMap& map, const Ray& ray, const RayStops& stops) {
  const double resolution = map.geometry().resolution();
  const Eigen::Vector3d direction = ray.direction.normalized();
  RayHit hit;
  hit.length = ray.length;
  for (const Crossed& crossed :
       crossedBy(ray.origin / resolution, direction, ray.length / resolution, 1e-9)) {
    const VoxelView view = viewWithoutEntropy(map, queryRules(), crossed.voxel);
    const double length = crossed.part.begin * resolution;
    const bool unknown = view.state == VoxelState::kUnknown || view.state == VoxelState::kOccluded;
    if (unknown) hit.first_unknown = std::min(hit.first_unknown, length);
    const bool occupied = view.state == VoxelState::kOccupied && stops.classes.contains(view.label);
    if (!occupied && !(unknown && stops.unknown)) continue;
    hit.end = occupied ? RayEnd::kOccupied : RayEnd::kUnknown;
    hit.label = occupied ? view.label : kFreeClass;
    hit.voxel = crossed.voxel;
    hit.length = length;
    break;
  }
  return hit;
}

/// Rays of all lengths, from within the map and from outside, some along axes.
std::vector<Ray> randomRays(int count, double extent, double most, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> coordinate(-extent, extent), length(0.0, most);
  std::vector<Ray> rays;
  for (int n = 0; n < count; ++n) {
    Ray ray = {{coordinate(random), coordinate(random), coordinate(random)},
               {normal(random), normal(random), normal(random)},
               length(random)};
    if (n % 4 == 0) ray.direction[n / 4 % 3] = 0.0;
    if (n % 8 == 0) ray.direction[(n / 8 + 1) % 3] = 0.0;
    if (n % 16 == 0) ray.direction[(n / 16 + 2) % 3] = 0.0;
    if (ray.direction.isZero()) ray.direction.x() = n % 32 == 0 ? 1.0 : -1.0;
    rays.push_back(ray);
  }
  return rays;
}

void expectSlowlyCast(const QueryMapKind& kind, const RayStops& stops, unsigned seed, int count) {
  const SemanticMap map = queryMap(seed, kind);
  const StateMap states(map, queryRules(), 2);
  const double extent = extentOf(kind) * kind.resolution;
  const std::vector<Ray> rays = randomRays(count, extent, extent, seed + 1);
  std::vector<RayHit> hits(rays.size());
  castRays(states, rays, stops, hits);
  int stopped = 0;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const std::string where =
        nameOf(rays[n].origin, rays[n].direction) + " for " + std::to_string(rays[n].length);
    const RayHit expected = slowlyCast(map, rays[n], stops);
    ASSERT_EQ(hits[n].end, expected.end) << where;
    ASSERT_EQ(hits[n].label, expected.label) << where;
    ASSERT_EQ(hits[n].voxel, expected.voxel) << where;
    ASSERT_NEAR(hits[n].length, expected.length, 1e-9) << where;
    if (std::isinf(expected.first_unknown)) {
      ASSERT_EQ(hits[n].first_unknown, expected.first_unknown) << where;
    } else {
      ASSERT_NEAR(hits[n].first_unknown, expected.first_unknown, 1e-9) << where;
    }
    stopped += expected.end != RayEnd::kNothing;
  }
  EXPECT_GT(stopped, 10);
  EXPECT_LT(stopped, count);
}

TEST(CastRay, EqualsLookingAtEveryVoxel) {
  QueryMapKind dense, sparse, known;
  sparse.occupied = 0.02;
  sparse.unknown = 0.02;
  known.unknown = 0.0;
  known.block_share = 1.0;
  known.occupied = 0.01;
  expectSlowlyCast(dense, {}, 11, 400);
  expectSlowlyCast(sparse, {}, 12, 600);
  expectSlowlyCast(known, {ClassFilter::all(), true}, 13, 400);
  expectSlowlyCast(sparse, {ClassFilter::all(), true}, 14, 300);
  expectSlowlyCast(sparse, {ClassFilter::allBut({3, 7}), false}, 15, 400);
  expectSlowlyCast(sparse, {{}, true}, 16, 300);
}

TEST(CastRay, FromOneOccupiedVoxelToAnother) {
  SemanticMap map(GridGeometry(0.5), 0.001, 3);
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  plane[0] = unitsOf(1.0);
  map.getOrAllocate({{0, 0, 0}}).add(2, plane.data());
  map.getOrAllocate({{-3, 0, 0}}).add(1, plane.data());
  const StateMap states(map, queryRules());
  RayHit hit = castRay(states, {{5.0, 0.25, 0.25}, {-2.0, 0.0, 0.0}, 20.0});
  EXPECT_EQ(hit.label, 2);
  EXPECT_DOUBLE_EQ(hit.length, 4.5);
  EXPECT_DOUBLE_EQ(hit.first_unknown, 0.0);
  hit = castRay(states, {{5.0, 0.25, 0.25}, {-2.0, 0.0, 0.0}, 20.0}, {{1}, false});
  EXPECT_EQ(hit.voxel, (GridIndex{-24, 0, 0}));
  EXPECT_DOUBLE_EQ(hit.length, 16.5);
  hit = castRay(states, {{5.0, 0.25, 0.25}, {-1.0, 0.0, 0.0}, 16.5}, {{1}, false});
  EXPECT_EQ(hit.end, RayEnd::kNothing) << "it ends at the face";
  hit = castRay(states, {{0.25, 0.25, 0.25}, {0.0, 0.0, 1.0}, 0.0});
  EXPECT_EQ(hit.end, RayEnd::kOccupied) << "the first voxel is looked at, however short the ray";
  hit = castRay(states, {{0.5, 0.25, 0.25}, {-1.0, 0.0, 0.0}, 1.0});
  EXPECT_DOUBLE_EQ(hit.length, 0.0) << "it starts on a face and goes into the voxel";
  hit = castRay(states, {{0.5, 0.25, 0.25}, {1.0, 0.0, 0.0}, 1.0});
  EXPECT_EQ(hit.end, RayEnd::kNothing);
  hit = castRay(states, Ray::between({4.0, 4.0, 4.0}, {0.1, 0.1, 0.1}));
  EXPECT_NEAR(hit.length, 3.5 * std::sqrt(3.0), 1e-9) << "through corners";
}

TEST(CastRay, MayBeInfiniteAndStartFarAway) {
  SemanticMap map(GridGeometry(0.5), 0.001, 3);
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  plane[0] = unitsOf(1.0);
  map.getOrAllocate({{1000, 1000, -1000}}).add(2, plane.data());
  const StateMap states(map, queryRules());
  const Eigen::Vector3d target = map.geometry().voxelCentre({{8000, 8000, -8000}});
  for (const Eigen::Vector3d& origin : {Eigen::Vector3d(-1e8, 3e7, 2.0), Eigen::Vector3d(0, 0, 0)}) {
    const RayHit hit = castRay(states, {origin, target - origin, kInfinity});
    EXPECT_EQ(hit.label, 2);
    EXPECT_NEAR(hit.length, (target - origin).norm(), 0.5);
    EXPECT_EQ(hit.first_unknown, 0.0);
    EXPECT_EQ(castRay(states, {origin, origin - target, kInfinity}).end, RayEnd::kNothing);
  }
  const SemanticMap nothing(GridGeometry(0.5), 0.001, 3);
  const RayHit hit = castRay(StateMap(nothing, queryRules()), {{1, 1, 1}, {1, 2, 3}, kInfinity});
  EXPECT_EQ(hit.end, RayEnd::kNothing);
  EXPECT_EQ(hit.first_unknown, 0.0);
  EXPECT_EQ(castRay(StateMap(nothing, queryRules()), {{1, 1, 1}, {1, 2, 3}, 5.0}, {{}, true}).end,
            RayEnd::kUnknown);
}

void expectRayRefused(const Ray& ray, const std::string& sentence) {
  const SemanticMap map = queryMap(21);
  const StateMap states(map, queryRules());
  const std::vector<Ray> rays = {{{0, 0, 0}, {1, 0, 0}, 1.0}, ray};
  std::vector<RayHit> hits(2);
  EXPECT_EQ(refusalOf([&] { castRays(states, rays, {}, hits); }), "ray 1 " + sentence);
  EXPECT_THROW(castRay(states, ray), std::invalid_argument);
}

TEST(CastRay, RefusesWhatIsNoRay) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expectRayRefused({{nan, 0, 0}, {1, 0, 0}, 1}, "has a coordinate that is not finite; remove such rays");
  expectRayRefused({{0, 0, 0}, {1, kInfinity, 0}, 1},
                   "has a coordinate that is not finite; remove such rays");
  expectRayRefused({{0, 0, 0}, {0, 0, 0}, 1}, "has the direction 0; give one of any length > 0");
  expectRayRefused({{0, 0, 0}, {1, 0, 0}, -1}, "has a negative length or none; give 0 m or more");
  expectRayRefused({{0, 0, 0}, {1, 0, 0}, nan}, "has a negative length or none; give 0 m or more");
  expectRayRefused({{1e12, 0, 0}, {1, 0, 0}, 1}, "starts beyond the map's grid; start it within the map");
  const SemanticMap map = queryMap(22);
  std::vector<RayHit> hits(3);
  EXPECT_THROW(castRays(StateMap(map, queryRules()), std::vector<Ray>(2), {}, hits), std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
