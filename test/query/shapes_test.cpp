// Boxes and spheres overlap the voxels that they overlap, the nearest obstacle is the nearest, sections show
// the voxels at their cells, and frontiers are free voxels beside unknown ones: each found by looking at
// every voxel.
#include "bki_mapping/query/queries.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>

#include "query/query_map.h"
#include "query/slow_frontiers.h"
#include "refusal_of.h"

namespace bki_mapping {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Calls visit(voxel) for all voxels of a map, and some around it.
template <typename Visit>
void forEachVoxel(const QueryMapKind& kind, Visit&& visit) {
  const int extent = extentOf(kind);
  for (int z = -extent; z < extent; ++z) {
    for (int y = -extent; y < extent; ++y) {
      for (int x = -extent; x < extent; ++x) visit(VoxelIndex{{x, y, z}});
    }
  }
}

template <typename Overlaps>
SpaceContent slowContent(const SemanticMap& map, const QueryMapKind& kind, Overlaps&& overlaps) {
  SpaceContent content;
  forEachVoxel(kind, [&](const VoxelIndex& voxel) {
    if (!overlaps(voxel)) return;
    const VoxelView view = viewWithoutEntropy(map, queryRules(), voxel);
    content.free += view.state == VoxelState::kFree;
    content.occupied += view.state == VoxelState::kOccupied;
    content.unknown += view.state == VoxelState::kUnknown || view.state == VoxelState::kOccluded;
    if (view.state == VoxelState::kOccupied) content.classes.insert(view.label);
  });
  return content;
}

void expectSame(const SpaceContent& a, const SpaceContent& b, const std::string& where) {
  ASSERT_EQ(a.free, b.free) << where;
  ASSERT_EQ(a.occupied, b.occupied) << where;
  ASSERT_EQ(a.unknown, b.unknown) << where;
  ASSERT_EQ(a.classes.ids(), b.classes.ids()) << where;
}

/// The corners of a box as columns.
Eigen::Matrix<double, 3, 8> cornersOf(const OrientedBox& box) {
  Eigen::Matrix<double, 3, 8> corners;
  for (int n = 0; n < 8; ++n) {
    const Eigen::Vector3d sign(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1);
    corners.col(n) = box.T_map_box * sign.cwiseProduct(box.half_extents);
  }
  return corners;
}

/// Whether a plane across one of 15 axes separates two boxes: from their corners, projected.
bool overlap(const OrientedBox& a, const OrientedBox& b) {
  std::vector<Eigen::Vector3d> axes;
  for (int i = 0; i < 3; ++i) {
    axes.push_back(a.T_map_box.linear().col(i));
    axes.push_back(b.T_map_box.linear().col(i));
    for (int j = 0; j < 3; ++j) {
      axes.push_back(a.T_map_box.linear().col(i).cross(b.T_map_box.linear().col(j)));
    }
  }
  const Eigen::Matrix<double, 3, 8> of_a = cornersOf(a), of_b = cornersOf(b);
  for (const Eigen::Vector3d& axis : axes) {
    if (axis.norm() < 1e-6) continue;
    const auto on_a = axis.transpose() * of_a, on_b = axis.transpose() * of_b;
    if (on_a.maxCoeff() <= on_b.minCoeff() || on_b.maxCoeff() <= on_a.minCoeff()) return false;
  }
  return true;
}

OrientedBox cubeOf(const VoxelIndex& voxel, const GridGeometry& geometry) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = geometry.voxelCentre(voxel);
  return {pose, Eigen::Vector3d::Constant(0.5 * geometry.resolution())};
}

class Shapes : public testing::Test {
 protected:
  Shapes() {
    kind_.blocks = 1;
    kind_.unknown = 0.3;
  }
  double coordinate() { return std::uniform_real_distribution<double>(-2.2, 2.2)(random_); }
  double size() { return std::uniform_real_distribution<double>(0.01, 1.0)(random_); }

  QueryMapKind kind_;
  std::mt19937 random_{1};
};

TEST_F(Shapes, BoxesEqualLookingAtEveryVoxel) {
  const SemanticMap map = queryMap(31, kind_);
  const StateMap states(map, queryRules());
  for (int n = 0; n < 100; ++n) {
    Eigen::Vector3d low(coordinate(), coordinate(), coordinate()), size_of(size(), size(), size());
    if (n % 4 == 0) low = (low * 4).array().round() / 4;  // faces between voxels
    if (n % 4 == 0) size_of = (size_of * 4).array().ceil() / 4;
    const Eigen::AlignedBox3d box(low, low + size_of);
    const auto overlaps = [&](const VoxelIndex& voxel) {
      const Eigen::Vector3d min = map.geometry().voxelCentre(voxel).array() - 0.125;
      return (min.array() < box.max().array()).all() && (min.array() + 0.25 > box.min().array()).all();
    };
    expectSame(contentOf(states, box), slowContent(map, kind_, overlaps), std::to_string(n));
  }
  const Eigen::AlignedBox3d point(Eigen::Vector3d(0.25, 0.25, 0.25), Eigen::Vector3d(0.25, 0.25, 0.25));
  const SpaceContent content = contentOf(states, point);
  EXPECT_EQ(content.free + content.occupied + content.unknown, 1u) << "a point lies in a voxel";
}

TEST_F(Shapes, SpheresEqualLookingAtEveryVoxel) {
  const SemanticMap map = queryMap(32, kind_);
  const StateMap states(map, queryRules());
  for (int n = 0; n < 100; ++n) {
    const Sphere sphere = {{coordinate(), coordinate(), coordinate()}, size()};
    const auto overlaps = [&](const VoxelIndex& voxel) {
      const Eigen::Vector3d centre = map.geometry().voxelCentre(voxel);
      return ((sphere.centre - centre).cwiseAbs().array() - 0.125).max(0.0).matrix().norm() < sphere.radius;
    };
    expectSame(contentOf(states, sphere), slowContent(map, kind_, overlaps), std::to_string(n));
  }
}

TEST_F(Shapes, OrientedBoxesEqualLookingAtEveryVoxel) {
  const SemanticMap map = queryMap(33, kind_);
  const StateMap states(map, queryRules(), 2);
  std::vector<Eigen::Isometry3d> poses;
  const OrientedBox vehicle = {Eigen::Isometry3d(Eigen::Translation3d(0.3, 0.0, 0.1)), {0.9, 0.4, 0.3}};
  std::normal_distribution<double> normal;
  for (int n = 0; n < 70; ++n) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() << coordinate(), coordinate(), coordinate();
    if (n % 3 == 1) pose.rotate(Eigen::AngleAxisd(coordinate(), Eigen::Vector3d::UnitZ()));
    if (n % 3 == 2) {
      pose.rotate(Eigen::Quaterniond(normal(random_), normal(random_), normal(random_), 1.0).normalized());
    }
    poses.push_back(pose);
  }
  std::vector<SpaceContent> contents(poses.size());
  contentsAlong(states, vehicle, poses, contents);
  for (std::size_t n = 0; n < poses.size(); ++n) {
    const OrientedBox box = {poses[n] * vehicle.T_map_box, vehicle.half_extents};
    const auto overlaps = [&](const VoxelIndex& voxel) {
      const double apart = (map.geometry().voxelCentre(voxel) - box.T_map_box.translation()).norm();
      return apart < 1.5 && overlap(box, cubeOf(voxel, map.geometry()));
    };
    expectSame(contents[n], slowContent(map, kind_, overlaps), std::to_string(n));
    expectSame(contents[n], contentOf(states, box), std::to_string(n));
  }
}

TEST_F(Shapes, ManyAtOnceEqualOneByOne) {
  const SemanticMap map = queryMap(37, kind_);
  const StateMap states(map, queryRules(), 2);
  std::vector<Eigen::AlignedBox3d> boxes;
  std::vector<Sphere> spheres;
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d at(coordinate(), coordinate(), coordinate());
    boxes.emplace_back(at, at + Eigen::Vector3d(size(), size(), size()));
    spheres.push_back({at, size()});
  }
  std::vector<SpaceContent> of_boxes(200), of_spheres(200);
  contentsOf(states, boxes, of_boxes);
  contentsOf(states, spheres, of_spheres);
  for (std::size_t n = 0; n < 200; ++n) {
    expectSame(of_boxes[n], contentOf(states, boxes[n]), std::to_string(n));
    expectSame(of_spheres[n], contentOf(states, spheres[n]), std::to_string(n));
  }
}

TEST(SpaceContent, NamesTheWorstClass) {
  SpaceContent content;
  content.classes = {3, 7};
  EXPECT_EQ(content.worst(std::vector<ClassId>{9, 7, 3}), ClassId{7});
  EXPECT_EQ(content.worst(std::vector<ClassId>{3, 7}), ClassId{3});
  EXPECT_FALSE(content.worst(std::vector<ClassId>{1}));
  EXPECT_TRUE(content.classes.intersects({3}));
  EXPECT_FALSE(content.classes.intersects({4}));
}

TEST_F(Shapes, RefusesWhatIsNoShape) {
  const SemanticMap map = queryMap(34, kind_);
  const StateMap states(map, queryRules());
  const auto box = [&](Eigen::Vector3d low, Eigen::Vector3d high) {
    contentOf(states, Eigen::AlignedBox3d(low, high));
  };
  expectRefused("the box is inside out or empty; give sizes > 0 and min below max", [&] {
    box({1, 0, 0}, {0, 1, 1});
  });
  expectRefused("the box has a coordinate or size that is not finite; give finite ones", [&] {
    box({0, 0, 0}, {1, kNan, 1});
  });
  expectRefused("the box reaches beyond the map's grid; cut it to where the map is", [&] {
    box({0, 0, 0}, {1, 1, 1e9});
  });
  expectRefused("the box spans 1003003001 voxels; split it, 100 million are the most", [&] {
    box({0, 0, 0}, {250, 250, 250});
  });
  expectRefused("the sphere has a radius that is not a number > 0; give metres > 0", [&] {
    contentOf(states, Sphere{{0, 0, 0}, -1.0});
  });
  OrientedBox oriented = {Eigen::Isometry3d::Identity(), {1, 1, 0}};
  expectRefused("the box has a half extent that is not a number > 0; give metres > 0",
                [&] { contentOf(states, oriented); });
  oriented.half_extents.setOnes();
  std::vector<Eigen::Isometry3d> poses(70, Eigen::Isometry3d::Identity());
  poses[66].linear() *= 2.0;
  std::vector<SpaceContent> contents(70);
  expectRefused("the box at pose 66 is not rotated by a rotation; give a pose without scale or shear",
                [&] { contentsAlong(states, oriented, poses, contents); });
  EXPECT_THROW(contentsAlong(states, oriented, std::vector<Eigen::Isometry3d>(3), contents),
               std::invalid_argument);
  std::vector<Sphere> spheres(70, Sphere{{0, 0, 0}, 0.1});
  spheres[65].radius = kNan;
  expectRefused("sphere 65 has a radius that is not a number > 0; give metres > 0",
                [&] { contentsOf(states, spheres, contents); });
  const std::vector<Eigen::AlignedBox3d> boxes(69, {Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()});
  expectRefused("there are 69 boxes and room for 70 contents; give as many contents as boxes",
                [&] { contentsOf(states, boxes, contents); });
}

TEST(NearestObstacle, EqualsLookingAtEveryVoxel) {
  for (const double occupied : {0.05, 0.0003}) {
    QueryMapKind kind;
    kind.occupied = occupied;
    const SemanticMap map = queryMap(35, kind);
    const StateMap states(map, queryRules());
    std::vector<std::pair<VoxelIndex, ClassId>> obstacles;
    forEachVoxel(kind, [&](const VoxelIndex& voxel) {
      const VoxelView view = viewWithoutEntropy(map, queryRules(), voxel);
      if (view.state == VoxelState::kOccupied) obstacles.emplace_back(voxel, view.label);
    });
    std::mt19937 random(36);
    std::uniform_real_distribution<double> coordinate(-12.0, 12.0);
    int missing = 0;
    std::vector<Eigen::Vector3d> points;
    for (int n = 0; n < 100; ++n) {
      Eigen::Vector3d point(coordinate(random), coordinate(random), coordinate(random));
      if (n % 3 == 0) point = (point * 4).array().round() / 4;  // many are equally near
      const ClassFilter classes = n % 2 == 0 ? ClassFilter::all() : ClassFilter{3, 9};
      const double most = n % 5 == 0 ? 1.5 : kInfinity;
      std::optional<NearestObstacle> expected;
      for (const auto& [voxel, label] : obstacles) {
        const double distance = (map.geometry().voxelCentre(voxel) - point).norm();
        if (!classes.contains(label) || distance > most) continue;
        if (expected && distance > expected->distance - 1e-9 &&
            !(distance < expected->distance + 1e-9 && voxel < expected->voxel)) {
          continue;
        }
        expected = NearestObstacle{voxel, label, distance};
      }
      points.push_back(point);
      const auto found = nearestObstacle(states, point, classes, most);
      ASSERT_EQ(found.has_value(), expected.has_value()) << n;
      missing += !found;
      if (!found) continue;
      ASSERT_EQ(found->voxel, expected->voxel) << n;
      ASSERT_EQ(found->label, expected->label) << n;
      ASSERT_NEAR(found->distance, expected->distance, 1e-9) << n;
    }
    EXPECT_GT(missing, 0);
    EXPECT_LT(missing, 50);
    std::vector<std::optional<NearestObstacle>> all(points.size());
    nearestObstacles(states, points, {3, 9}, 5.0, all);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const auto one = nearestObstacle(states, points[n], {3, 9}, 5.0);
      ASSERT_EQ(all[n].has_value(), one.has_value()) << n;
      if (one) {
        ASSERT_EQ(all[n]->voxel, one->voxel) << n;
      }
    }
    points[77].x() = kNan;
    EXPECT_THROW(nearestObstacles(states, points, {}, 5.0, all), std::invalid_argument);
    EXPECT_THROW(nearestObstacles(states, {points.data(), 3}, {}, 5.0, all), std::invalid_argument);
    EXPECT_THROW(nearestObstacle(states, {kNan, 0, 0}), std::invalid_argument);
    EXPECT_THROW(nearestObstacle(states, {0, 0, 0}, ClassFilter::all(), -1.0), std::invalid_argument);
    EXPECT_THROW(nearestObstacle(states, {0, 0, 0}, ClassFilter::all(), kNan), std::invalid_argument);
  }
}

void expectShows(const Section& section, const SemanticMap& map) {
  ASSERT_EQ(section.states.size(), section.width * section.height);
  ASSERT_EQ(section.labels.size(), section.states.size());
  for (std::size_t row = 0; row < section.height; ++row) {
    for (std::size_t column = 0; column < section.width; ++column) {
      const VoxelView view = viewPoint(map, queryRules(), section.centreOf(column, row));
      ASSERT_EQ(section.states[row * section.width + column], view.state);
      ASSERT_EQ(section.labels[row * section.width + column], view.label);
    }
  }
}

TEST(Section, ShowsTheVoxelsAtItsCells) {
  const SemanticMap map = queryMap(37);
  const StateMap states(map, queryRules(), 2);
  const Section horizontal =
      horizontalSection(states, -0.6, {Eigen::Vector2d(-7.1, -5), Eigen::Vector2d(6.6, 7)});
  EXPECT_EQ(horizontal.width, 56u);  // from -7.25 to 6.75
  EXPECT_EQ(horizontal.height, 48u);
  EXPECT_TRUE(horizontal.centreOf(0, 0).isApprox(Eigen::Vector3d(-7.125, -4.875, -0.625)));
  expectShows(horizontal, map);
  const Section vertical = verticalSection(states, {-5, 3}, {4, -9}, -2.0, 3.1);
  EXPECT_EQ(vertical.width, 60u);  // 15 m
  EXPECT_EQ(vertical.height, 21u);
  EXPECT_TRUE(vertical.centreOf(0, 0).isApprox(Eigen::Vector3d(-5 + 0.125 * 0.6, 3 - 0.125 * 0.8, -1.875)));
  expectShows(vertical, map);

  const Eigen::AlignedBox2d square(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1));
  expectRefused("the section has a coordinate that is not finite; give finite ones",
                [&] { horizontalSection(states, kNan, square); });
  expectRefused("the section reaches beyond the map's grid; cut it to where the map is",
                [&] { horizontalSection(states, 1e10, square); });
  expectRefused("the section's area is inside out; give a min below its max", [&] {
    horizontalSection(states, 0, {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)});
  });
  expectRefused(
      "the section has 40001.000000 x 40000.000000 cells; make it smaller, 100 million are the most", [&] {
        horizontalSection(states, 0, {Eigen::Vector2d(0, 0), Eigen::Vector2d(10000.1, 10000)});
      });
  expectRefused("the section stands on two points that are the same; give two that differ", [&] {
    verticalSection(states, {1, 1}, {1, 1}, 0, 1);
  });
  expectRefused("the section's heights are inside out; give min_z below max_z", [&] {
    verticalSection(states, {1, 1}, {2, 1}, 1, 0);
  });
}

void expectSameFrontiers(const std::vector<Frontier>& a, const std::vector<Frontier>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t f = 0; f < a.size(); ++f) {
    ASSERT_EQ(a[f].size, b[f].size);
    ASSERT_EQ(a[f].centre, b[f].centre);
  }
}

TEST(Frontiers, OfABoxAreThoseOfItsVoxels) {
  QueryMapKind kind;
  kind.blocks = 2;
  kind.unknown = 0.04;
  const SemanticMap map = queryMap(39, kind);
  const StateMap states(map, queryRules(), 2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-5.0, 5.0);
  int boxes_with_any = 0;
  for (int n = 0; n < 12; ++n) {
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 2; ++corner) {
      box.extend(Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random)));
    }
    if (n == 0) box = {Eigen::Vector3d(-2.0, -0.5, 0.0), Eigen::Vector3d(2.0, 0.25, 0.25)};  // along faces
    FrontierRules rules;
    rules.box = box;
    const auto found = frontiers(states, rules);
    boxes_with_any += !found.empty();
    EXPECT_EQ(clustersOf(found), slowFrontiers(map, queryRules(), [&](const VoxelIndex& v) {
                const Eigen::Array3d low = 0.25 * Eigen::Array3d(v.x, v.y, v.z), high = low + 0.25;
                return (high > box.min().array()).all() && (low < box.max().array()).all();
              }));
    rules.with_voxels = false;
    const auto outlines = frontiers(states, rules);
    expectSameFrontiers(outlines, found);
    for (const Frontier& each : outlines) EXPECT_TRUE(each.voxels.empty());
  }
  EXPECT_GT(boxes_with_any, 6);
  FrontierRules all;
  all.box.emplace(Eigen::Vector3d::Constant(-1e5), Eigen::Vector3d::Constant(1e5));
  expectSameFrontiers(frontiers(states, all), frontiers(states));
}

TEST(Frontiers, RefuseBoxesThatAreNone) {
  const SemanticMap map = queryMap(39);
  const StateMap states(map, queryRules(), 1);
  const auto sentence = [&](const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
    FrontierRules rules;
    rules.box.emplace(min, max);
    return refusalOf([&] { frontiers(states, rules); });
  };
  EXPECT_EQ(sentence({0, 2, 0}, {1, 1, 1}), "the box is inside out; give a min below its max");
  EXPECT_EQ(sentence({0, kNan, 0}, {1, 1, 1}),
            "the box has a coordinate that is not finite; give finite ones");
  EXPECT_EQ(sentence({0, 0, 0}, {1, kInfinity, 1}),
            "the box has a coordinate that is not finite; give finite ones");
  EXPECT_EQ(sentence({0, 0, 0}, {1, 1e10, 1}),
            "the box reaches beyond the map's grid; cut it to where the map is");
}

TEST(Frontiers, AreFreeVoxelsBesideUnknownOnes) {
  for (const double unknown : {0.3, 0.003, 0.97}) {
    QueryMapKind kind;
    kind.blocks = 2;
    kind.unknown = unknown;
    kind.occupied = 0.01;
    const SemanticMap map = queryMap(38, kind);
    const StateMap states(map, queryRules(), 2);
    const auto found = frontiers(states);
    FrontierRules without_voxels;
    without_voxels.with_voxels = false;
    expectSameFrontiers(frontiers(states, without_voxels), found);
    std::set<std::set<GridIndex>> clusters;
    for (std::size_t f = 0; f < found.size(); ++f) {
      const auto& voxels = found[f].voxels;
      ASSERT_TRUE(std::is_sorted(voxels.begin(), voxels.end()));
      ASSERT_EQ(found[f].size, voxels.size());
      clusters.insert({voxels.begin(), voxels.end()});
      Eigen::Vector3d centre = Eigen::Vector3d::Zero();
      for (const VoxelIndex& voxel : voxels) centre += map.geometry().voxelCentre(voxel);
      ASSERT_LT((centre / double(voxels.size()) - found[f].centre).norm(), 1e-9);
      if (f == 0) continue;
      const auto& before = found[f - 1].voxels;
      ASSERT_TRUE(before.size() > voxels.size() ||
                  (before.size() == voxels.size() && before.front() < voxels.front()));
    }
    EXPECT_EQ(clusters.size(), found.size());
    EXPECT_EQ(clusters, slowFrontiers(map, queryRules()));
    const auto large = frontiers(states, 5);
    EXPECT_EQ(large.size(), std::size_t(std::count_if(found.begin(), found.end(),
                                                      [](const auto& f) { return f.voxels.size() >= 5; })));
  }
}

}  // namespace
}  // namespace bki_mapping
