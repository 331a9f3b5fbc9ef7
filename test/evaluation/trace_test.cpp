// What traces of what was never there remain, on a drive constructed by hand.
#include "evaluation/trace_evaluation.h"

#include <gtest/gtest.h>

#include "evaluation/occupied_map.h"

namespace bki_mapping {
namespace {

bool isTraceLabel(std::uint32_t label) {
  return label == 7;
}

bool isNothingLabel(std::uint32_t label) {
  return label == 7 || label == 8;
}

/// Scans every second of a sensor at (0.5, 0.5, 0.5): points at x on a line, and the occupied voxels after
/// each.
class TraceDrive {
 public:
  void add(const std::vector<std::pair<double, std::uint32_t>>& points, const std::vector<double>& occupied) {
    Scan scan;
    scan.origin = {0.5, 0.5, 0.5};
    scan.stamp = 1000000000 * (1 + n_++);
    for (const auto& [x, label] : points) {
      scan.points.emplace_back(static_cast<float>(x - 0.5), 0.0f, 0.0f);
      scan.labels.push_back(label);
    }
    std::vector<Eigen::Vector3d> voxels;
    for (const double x : occupied) voxels.emplace_back(x, 0.5, 0.5);
    map_ = mapOf(voxels);
    MapOccupants map(map_, rules_);
    evaluation_.add(scan, map);
  }
  TraceQuality quality() const {
    MapOccupants map(map_, rules_);
    return evaluation_.quality(map);
  }

 private:
  TraceEvaluation evaluation_{GridGeometry(1.0), isTraceLabel, isNothingLabel};
  SemanticMap map_ = mapOf({});
  const StateRules rules_;
  std::uint64_t n_ = 0;
};

TEST(Traces, AreCountedASecondAndTenLaterAndAtTheEnd) {
  TraceDrive drive;
  drive.add({{3.5, 7}, {12.5, 7}, {14.5, 7}, {14.2, 1}, {12.2, 8}}, {3.5, 12.5, 14.5});
  drive.add({{4.5, 7}}, {3.5, 4.5, 14.5});  // a second later, 12.5 is free again
  for (int n = 0; n < 8; ++n) drive.add({}, {4.5, 14.5});
  drive.add({}, {3.5, 14.5});  // after ten seconds, 3.5 is occupied again
  drive.add({{5.5, 7}}, {4.5, 5.5, 14.5});
  const TraceQuality quality = drive.quality();
  EXPECT_EQ(quality.points, 5u);
  EXPECT_EQ(quality.all_points, 7u);
  const auto expect = [](const Traces& traces, std::size_t points, std::size_t left) {
    EXPECT_EQ(traces.points, points);
    EXPECT_EQ(traces.left, left);
  };
  // Within 5 m: 3.5, 4.5, 5.5, of which the last is not yet a second old. In 14.5 is something, too.
  expect(quality.up_to[0].after[0], 2, 2);
  expect(quality.up_to[0].after[1], 2, 2);
  expect(quality.up_to[0].at_end, 2, 1);
  expect(quality.up_to[2].after[0], 3, 2);
  expect(quality.up_to[2].after[1], 3, 2);
  expect(quality.up_to[3].at_end, 3, 1);
}

TEST(Traces, AScanWithoutNothingKeepsAllElse) {
  Scan scan;
  scan.points = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  scan.labels = {1, 7, 2, 8};
  std::vector<std::uint32_t> predicted = {11, 17, 12, 18};
  removeNothing(isNothingLabel, scan, predicted);
  EXPECT_EQ(scan.labels, (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(predicted, (std::vector<std::uint32_t>{11, 12}));
  EXPECT_EQ(scan.points, (std::vector<Eigen::Vector3f>{{1, 0, 0}, {3, 0, 0}}));
}

}  // namespace
}  // namespace bki_mapping
