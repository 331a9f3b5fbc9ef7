// Points read in batches equal points read one by one.
#include "bki_mapping/query/queries.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>

#include "query/query_map.h"
#include "refusal_of.h"

namespace bki_mapping {
namespace {

/// Arrays of values that no field has.
struct Answers {
  std::vector<VoxelState> states;
  std::vector<ClassId> labels;
  std::vector<float> occupancy, class_probability, probability, variance;

  explicit Answers(std::size_t n)
      : states(n, VoxelState(9)),
        labels(n, 99),
        occupancy(n, -1),
        class_probability(n, -1),
        probability(n, -1),
        variance(n, -1) {}
  PointValues values() {
    return {states.data(),      labels.data(),  occupancy.data(), class_probability.data(),
            probability.data(), variance.data()};
  }
};

std::vector<Eigen::Vector3d> randomPoints(std::size_t count, double extent, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(-extent, extent);
  std::vector<Eigen::Vector3d> points(count);
  for (Eigen::Vector3d& p : points) p = {coordinate(random), coordinate(random), coordinate(random)};
  return points;
}

template <typename Point>
void compare(const SemanticMap& map, const std::vector<Point>& points, int threads) {
  const StateMap states(map, queryRules(), threads);
  Answers answers(points.size());
  readPoints(states, points, answers.values());
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Eigen::Vector3d point = points[n].template cast<double>();
    const VoxelView expected = map.geometry().contains(point) ? viewPoint(map, queryRules(), point)
                                                              : viewPoint(map, queryRules(), {1e6, 0, 0});
    ASSERT_EQ(answers.states[n], expected.state) << n;
    ASSERT_EQ(answers.labels[n], expected.label) << n;
    ASSERT_EQ(answers.occupancy[n], expected.occupancy) << n;
    ASSERT_EQ(answers.class_probability[n], expected.class_probability) << n;
    ASSERT_EQ(answers.probability[n], expected.probability) << n;
    ASSERT_EQ(answers.variance[n], expected.variance) << n;
    if (!map.geometry().contains(point)) continue;
    const VoxelIndex voxel = map.geometry().voxelAt(point);
    ASSERT_EQ(states.state(voxel), expected.state) << n;
    ASSERT_EQ(states.label(voxel), expected.label) << n;
  }
}

TEST(ReadPoints, EqualsOnePointAfterTheOther) {
  const SemanticMap map = queryMap(1);
  compare(map, randomPoints(30000, 8.0, 2), 2);
  compare(map, randomPoints(333, 8.0, 3), 1);
  std::vector<Eigen::Vector3f> floats;
  for (const Eigen::Vector3d& point : randomPoints(20000, 8.0, 4)) floats.push_back(point.cast<float>());
  compare(map, floats, 2);
}

TEST(ReadPoints, OnFacesAndBeyondTheGrid) {
  const SemanticMap map = queryMap(5);
  std::vector<Eigen::Vector3d> points = {{1e300, 0, 0}, {0, -1e12, 0}, {0, 0, 6.7e7}, {0, 0, -6.8e7}};
  for (const Eigen::Vector3d& point : randomPoints(5000, 8.0, 6)) {
    points.push_back((point / 0.25).array().round() * 0.25);
  }
  compare(map, points, 2);
}

TEST(ReadPoints, FillsOnlyWhatIsWanted) {
  const SemanticMap map = queryMap(7);
  const StateMap states(map, queryRules());
  const auto points = randomPoints(100, 5.0, 8);
  Answers all(100), some(100);
  readPoints(states, points, all.values());
  PointValues wanted;
  wanted.labels = some.labels.data();
  wanted.variance = some.variance.data();
  readPoints(states, points, wanted);
  EXPECT_EQ(some.labels, all.labels);
  EXPECT_EQ(some.variance, all.variance);
  EXPECT_EQ(some.states, Answers(100).states);
  EXPECT_EQ(some.probability, Answers(100).probability);
  readPoints(states, Span<const Eigen::Vector3d>(), all.values());
}

TEST(ReadPoints, OfAnEmptyMapAreUnknown) {
  const SemanticMap map(GridGeometry(0.3), 0.001, 3);
  compare(map, randomPoints(50, 5.0, 9), 1);
}

TEST(ReadPoints, ASnapshotAnswersAsBefore) {
  SemanticMap map = queryMap(10);
  const SemanticMap before = queryMap(10), snapshot = map.snapshot();
  const StateMap states(snapshot, queryRules());
  map.clear();
  const auto points = randomPoints(2000, 8.0, 11);
  Answers answers(points.size());
  readPoints(states, points, answers.values());
  for (std::size_t n = 0; n < points.size(); ++n) {
    ASSERT_EQ(answers.states[n], viewPoint(before, queryRules(), points[n]).state);
  }
}

TEST(ReadPoints, NamesThePointThatIsNotFinite) {
  const SemanticMap map = queryMap(12);
  const StateMap states(map, queryRules(), 2);
  auto points = randomPoints(40000, 8.0, 13);
  points[39000].y() = std::numeric_limits<double>::infinity();
  points[123].z() = std::numeric_limits<double>::quiet_NaN();
  Answers answers(points.size());
  EXPECT_EQ(refusalOf([&] { readPoints(states, points, answers.values()); }),
            "point 123 of 40000 has a coordinate that is not finite; remove such points");
}

TEST(StateMap, RefusesImpossibleThreads) {
  const SemanticMap map = queryMap(14);
  EXPECT_THROW(StateMap(map, queryRules(), -1), std::invalid_argument);
  EXPECT_THROW(StateMap(map, queryRules(), 100000), std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
