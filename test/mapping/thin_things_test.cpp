// Without labels, what is thinner than a voxel stays in the map, although most scans of a lidar with few rows
// see the space around it empty, and leaves the map when it is carried away.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"

namespace bki_mapping {
namespace {

struct Box {
  Eigen::Vector3d low, high;
};

/// A table: its top of 4 cm, and four legs of 5 cm.
std::vector<Box> table() {
  std::vector<Box> boxes = {{{2.03, -0.77, 0.70}, {2.83, 0.83, 0.74}}};
  for (const double x : {2.03, 2.78}) {
    for (const double y : {-0.77, 0.78}) boxes.push_back({{x, y, 0.0}, {x + 0.05, y + 0.05, 0.70}});
  }
  return boxes;
}

/// Its faces are a floor, a ceiling and walls.
const Box kRoom = {{-6.0, -4.0, 0.0}, {6.0, 4.0, 2.5}};

/// Where a ray enters a box and where it leaves it, in lengths of its direction; it may miss it.
struct Passage {
  Passage(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    const Eigen::Array3d a = (box.low - origin).array() / direction.array(),
                         b = (box.high - origin).array() / direction.array();
    enters = a.min(b).maxCoeff();
    leaves = a.max(b).minCoeff();
  }
  bool hits() const { return enters > 0.0 && enters <= leaves; }
  double enters, leaves;
};

/// A lidar with 16 rows, 2 degrees apart, on a robot 0.35 m high. @param[out] on adds the points on boxes.
Scan scanOf(const std::vector<Box>& boxes, double x, std::uint64_t stamp, std::vector<Eigen::Vector3d>& on) {
  constexpr double kDegree = 3.14159265358979323846 / 180.0;
  Scan scan;
  scan.stamp = stamp;
  scan.origin = {x, 0.01, 0.35};
  for (int column = 0; column < 720; ++column) {
    for (int row = 0; row < 16; ++row) {
      const double azimuth = (0.5 * column + 0.01) * kDegree, elevation = (2.0 * row - 15.0) * kDegree;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double wall = Passage(kRoom, scan.origin, direction).leaves;
      double range = wall;
      for (const Box& box : boxes) {
        const Passage passage(box, scan.origin, direction);
        if (passage.hits()) range = std::min(range, passage.enters);
      }
      scan.points.push_back((range * direction).cast<float>());
      scan.labels.push_back(1);
      if (range < wall) on.push_back(scan.origin + range * direction);
    }
  }
  return scan;
}

double shareOccupied(const SemanticMapper& mapper, const std::vector<Eigen::Vector3d>& points) {
  const auto occupied = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector3d& point) {
    return viewPoint(mapper.map(), mapper.rules(), point).state == VoxelState::kOccupied;
  });
  return static_cast<double>(occupied) / static_cast<double>(points.size());
}

TEST(ThinThings, ATableStaysWithoutLabelsUntilItIsCarriedAway) {
  MapperConfig config;
  setParameters(config, loadParameterFile("robot"));
  config.resolution = 0.1;
  config.threads = 2;
  config.sensor_model.height = 0.35;
  SemanticMapper mapper(config, std::make_shared<const ClassTable>(loadClassTable("occupancy")));
  std::vector<Eigen::Vector3d> on_table, nothing;
  std::uint64_t stamp = 1000000000;
  const auto drive = [&](const std::vector<Box>& boxes, std::vector<Eigen::Vector3d>& on) {
    for (int i = 0; i < 35; ++i) mapper.integrate(scanOf(boxes, -2.0 + 0.1 * i, stamp += 100000000, on));
  };
  drive(table(), on_table);
  ASSERT_GT(on_table.size(), 1000u);
  EXPECT_GT(shareOccupied(mapper, on_table), 0.95);
  drive({}, nothing);
  EXPECT_LT(shareOccupied(mapper, on_table), 0.1);
}

}  // namespace
}  // namespace bki_mapping
