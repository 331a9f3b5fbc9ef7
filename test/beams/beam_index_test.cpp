// The beam table and the R-tree find every beam through a ball, and the table through a box: at the seam, the
// poles and the sensor.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "beams/beam_index.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

/// A table and the order of its beams.
struct SortedTable {
  std::unique_ptr<BeamTable> table = std::make_unique<BeamTable>();
  std::vector<std::uint32_t> order;
};

SortedTable sortedTable(const std::vector<Eigen::Vector3f>& directions) {
  SortedTable result;
  std::vector<std::uint32_t> cells;
  for (const Eigen::Vector3f& u : directions) cells.push_back(BeamTable::cellOf(u));
  result.table->build(cells, result.order);
  return result;
}

std::unique_ptr<BeamIndex> makeBeamIndex(BeamIndexType type, const std::vector<Eigen::Vector3f>& directions) {
  if (type == BeamIndexType::kRtree) return makeBeamRtree(directions);
  return std::move(sortedTable(directions).table);
}

std::vector<Eigen::Vector3f> sorted(const std::vector<Eigen::Vector3f>& directions) {
  std::vector<Eigen::Vector3f> result;
  for (const std::uint32_t b : sortedTable(directions).order) result.push_back(directions[b]);
  return result;
}

std::vector<std::uint32_t> query(const BeamIndex& index, const Eigen::Vector3f& centre, float radius) {
  std::vector<BeamRange> ranges;
  std::vector<std::uint32_t> beams;
  index.query(centre, radius, ranges);
  for (const BeamRange& range : ranges) {
    for (std::uint32_t b = range.first; b < range.last; ++b) beams.push_back(b);
  }
  return beams;
}

std::vector<Eigen::Vector3f> directionsOf(const Scan& scan) {
  std::vector<Eigen::Vector3f> directions;
  for (const auto& point : scan.points) directions.push_back(point.normalized());
  return sorted(directions);
}

/// The half-lines that pass through a ball, by testing each.
std::set<std::uint32_t> bruteForce(const std::vector<Eigen::Vector3f>& directions,
                                   const Eigen::Vector3d& centre, double radius) {
  std::set<std::uint32_t> found;
  for (std::uint32_t b = 0; b < directions.size(); ++b) {
    const Eigen::Vector3d u = directions[b].cast<double>().normalized();
    const double along = std::max(0.0, centre.dot(u));
    if ((centre - along * u).norm() < radius - 1e-6) found.insert(b);
  }
  return found;
}

class BothIndices : public testing::TestWithParam<BeamIndexType> {};

TEST_P(BothIndices, FindAllBeamsOfEveryBall) {
  std::mt19937 random(9);
  for (const reference::Scene& scene : reference::nastyScenes(400)) {
    const auto directions = directionsOf(scene.scan);
    const auto index = makeBeamIndex(GetParam(), directions);
    for (int trial = 0; trial < 300; ++trial) {
      // Balls about points on beams, on the coordinate planes (and so on the seam), and beside beams.
      const float scale = std::uniform_real_distribution<float>(0.0f, 1.5f)(random);
      Eigen::Vector3f centre = scene.scan.points[random() % scene.scan.points.size()] * scale;
      if (trial % 3 == 1) centre[static_cast<int>(random() % 3)] = 0.0f;
      if (trial % 3 == 2) centre += Eigen::Vector3f::Random() * 0.5f;
      const float radius = std::uniform_real_distribution<float>(0.01f, 1.0f)(random);
      const std::vector<std::uint32_t> beams = query(*index, centre, radius);
      const std::set<std::uint32_t> found(beams.begin(), beams.end());
      EXPECT_EQ(found.size(), beams.size()) << scene.name << ": a beam is found twice";
      for (const std::uint32_t b : bruteForce(directions, centre.cast<double>(), radius)) {
        ASSERT_TRUE(found.count(b)) << scene.name << ": beam " << b << " is missing at "
                                    << centre.transpose();
      }
    }
  }
}

TEST_P(BothIndices, FindFewOtherBeams) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Vector3f> directions;
  for (int i = 0; i < 20000; ++i) {
    directions.push_back(Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized());
  }
  directions = sorted(directions);
  const auto index = makeBeamIndex(GetParam(), directions);
  std::size_t found = 0, needed = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3f centre = 10.0f * directions[static_cast<std::size_t>(trial)];
    found += query(*index, centre, 1.0f).size();
    needed += bruteForce(directions, centre.cast<double>(), 1.0).size();
  }
  EXPECT_LT(found, 3 * needed);
}

TEST_P(BothIndices, AllBeamsAtTheSensorAndNoneOfNone) {
  const auto directions = directionsOf(reference::nastyScenes(50)[0].scan);
  const Eigen::Vector3f near(0.1f, 0.0f, 0.0f), far(1.0f, 0.0f, 0.0f);
  EXPECT_EQ(query(*makeBeamIndex(GetParam(), directions), near, 0.2f).size(), directions.size());
  EXPECT_TRUE(query(*makeBeamIndex(GetParam(), {}), far, 0.2f).empty());
  EXPECT_TRUE(query(*makeBeamIndex(GetParam(), {}), near, 0.2f).empty());
}

/// Whether a half-line meets a box, by the parts of it between the planes of each pair of faces.
bool meets(const Eigen::Vector3d& u, const Eigen::AlignedBox3d& box) {
  double enter = 0.0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min()[axis], high = box.max()[axis];
    if (u[axis] == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    enter = std::max(enter, std::min(low / u[axis], high / u[axis]));
    leave = std::min(leave, std::max(low / u[axis], high / u[axis]));
  }
  return enter <= leave;
}

std::vector<std::uint32_t> query(const BeamTable& table, const Eigen::AlignedBox3d& box) {
  std::vector<BeamRange> ranges;
  std::vector<std::uint32_t> beams;
  table.query(box, ranges);
  EXPECT_LE(ranges.size(), BeamTable::kMostRanges);
  for (const BeamRange& range : ranges) {
    for (std::uint32_t b = range.first; b < range.last; ++b) beams.push_back(b);
  }
  return beams;
}

TEST(BeamTable, FindsAllBeamsOfEveryBox) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> side(0.0f, 2.0f);
  for (const reference::Scene& scene : reference::nastyScenes(400)) {
    const auto directions = directionsOf(scene.scan);
    const SortedTable sorted_table = sortedTable(directions);
    for (int trial = 0; trial < 300; ++trial) {
      // Boxes with a corner on a beam; across coordinate planes, and so the seam and the poles; with the
      // sensor on a face or inside.
      Eigen::Vector3f corner = scene.scan.points[random() % scene.scan.points.size()] * side(random);
      const Eigen::Vector3f sides(side(random), side(random), trial % 5 == 0 ? 20.0f : side(random));
      if (trial % 3 == 1) corner[static_cast<int>(random() % 3)] = trial % 2 == 0 ? 0.0f : -0.5f;
      if (trial % 7 == 0) corner = -0.5f * sides;
      if (trial % 11 == 0) corner[static_cast<int>(random() % 3)] = -sides.maxCoeff();
      const Eigen::AlignedBox3d box(corner.cast<double>(), (corner + sides).cast<double>());
      const std::vector<std::uint32_t> beams = query(*sorted_table.table, box);
      const std::set<std::uint32_t> found(beams.begin(), beams.end());
      EXPECT_EQ(found.size(), beams.size()) << scene.name << ": a beam is found twice";
      for (std::uint32_t b = 0; b < directions.size(); ++b) {
        ASSERT_TRUE(found.count(b) || !meets(directions[b].cast<double>(), box))
            << scene.name << ": beam " << b << " is missing at " << box.min().transpose() << " to "
            << box.max().transpose();
      }
    }
  }
}

/// Boxes that a beam touches at one corner: in single precision, the corner may be in the bin beside that of
/// the beam.
TEST(BeamTable, FindsBeamsAtTheEdgesOfBins) {
  constexpr int kBins = kBeamColumns / 4;  // of a quadrant
  std::vector<Eigen::Vector3f> directions;
  for (int bin = 1; bin < kBins; ++bin) {
    const float y = static_cast<float>(bin) / kBins;
    for (int ulps = -30; ulps <= 30; ++ulps) {
      constexpr float kUlp = std::numeric_limits<float>::epsilon();
      directions.emplace_back((1.0f - y) * (1.0f + static_cast<float>(ulps) * kUlp), y, 0.0f);
    }
  }
  directions = sorted(directions);
  const SortedTable sorted_table = sortedTable(directions);
  for (const double range : {1.0, 0.3, 3.7, 7.3, 11.1, 47.9}) {
    for (std::uint32_t b = 0; b < directions.size(); ++b) {
      const Eigen::Vector3d end = range * directions[b].cast<double>();
      const Eigen::AlignedBox3d right(end - Eigen::Vector3d(0.001, 0.0, 0.001),
                                      end + Eigen::Vector3d(0.0, 0.001, 0.001)),
          left(end - Eigen::Vector3d(0.0, 0.001, 0.001), end + Eigen::Vector3d(0.001, 0.0, 0.001));
      for (const Eigen::AlignedBox3d& box : {right, left}) {
        const std::vector<std::uint32_t> beams = query(*sorted_table.table, box);
        ASSERT_EQ(std::count(beams.begin(), beams.end(), b), 1)
            << "beam " << directions[b].transpose() << " at " << range << " m";
      }
    }
  }
}

/// A ball around the box finds more than half as many again.
TEST(BeamTable, FindsFewOtherBeamsOfABox) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Vector3f> directions;
  for (int i = 0; i < 20000; ++i) {
    directions.push_back(Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized());
  }
  const SortedTable sorted_table = sortedTable(sorted(directions));
  directions = sorted(directions);
  std::size_t found = 0, needed = 0, of_ball = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3f centre = 10.0f * directions[static_cast<std::size_t>(97 * trial)];
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(1.0), c = centre.cast<double>();
    const Eigen::AlignedBox3d box(c - half, c + half);
    found += query(*sorted_table.table, box).size();
    of_ball += query(static_cast<const BeamIndex&>(*sorted_table.table), centre, std::sqrt(3.0f)).size();
    for (const Eigen::Vector3f& u : directions) needed += meets(u.cast<double>(), box);
  }
  EXPECT_LT(found, 2 * needed);
  EXPECT_LT(2 * found, of_ball + of_ball / 4);
}

TEST(BeamTable, FindsNoneOfNone) {
  const Eigen::AlignedBox3d near(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)),
      far(Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(2, 2, 2));
  EXPECT_TRUE(query(*sortedTable({}).table, near).empty());
  EXPECT_TRUE(query(*sortedTable({}).table, far).empty());
  EXPECT_TRUE(query(BeamTable(), far).empty());
}

INSTANTIATE_TEST_SUITE_P(Indices, BothIndices, testing::Values(BeamIndexType::kTable, BeamIndexType::kRtree));

TEST(BeamTable, CountsTheBeamsBeforeEachBin) {
  constexpr std::uint32_t kBins = kBeamRows * kBeamColumns;
  BeamTable table;  // keeps its memory, so what earlier beams left in it must not matter
  std::vector<std::uint32_t> order;
  for (const std::vector<std::uint32_t>& cells :
       {std::vector<std::uint32_t>{kBins - 1, 0, 7, 7}, {70000, 3000, 3000}, {}, {kBins - 1}, {0}, {5}}) {
    table.build(cells, order);
    std::vector<std::uint32_t> sorted_cells = cells;
    std::sort(sorted_cells.begin(), sorted_cells.end());
    ASSERT_EQ(table.begin().size(), kBins + 1);
    for (std::uint32_t bin = 0; bin <= kBins; ++bin) {
      const auto before = std::lower_bound(sorted_cells.begin(), sorted_cells.end(), bin);
      ASSERT_EQ(table.begin()[bin], before - sorted_cells.begin()) << bin;
    }
    std::vector<std::uint32_t> beams(cells.size());
    std::iota(beams.begin(), beams.end(), 0u);
    std::stable_sort(beams.begin(), beams.end(), [&](auto a, auto b) { return cells[a] < cells[b]; });
    EXPECT_EQ(order, beams);
  }
}

}  // namespace
}  // namespace bki_mapping
