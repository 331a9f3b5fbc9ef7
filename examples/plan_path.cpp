// Plans how a robot drives through a mapped street: hybrid A*, which searches among arcs that the robot can
// drive. Usage: plan_path FILE.bkm CLASSES X Y YAW X Y YAW, start and goal in the map frame [m, rad].
// Writes poses on the ground, 0.1 m apart, and the cost of the ground there: x, y, z, yaw, cost.
#include <bki_mapping/io/class_table_yaml.h>
#include <bki_mapping/io/mapper_file.h>
#include <bki_mapping/map/column_map.h>
#include <bki_mapping/query/distance_field.h>
#include <bki_mapping/query/shapes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <queue>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

using namespace bki_mapping;

const Eigen::Vector3d kHalf(0.6, 0.4, 0.5);  // half extents of the robot [m]
constexpr double kLift = 0.1;                // of its box above the ground [m]
constexpr double kTurn = 1.5;                // its turning radius [m]
constexpr double kClearance = 1.0;           // that it keeps from obstacles where there is room [m]
constexpr double kPeriod = 0.1;              // between the poses of a path [m]

using Pose = Eigen::Vector3d;     // x, y [m], yaw [rad]
using Arc = std::array<Pose, 6>;  // poses one after another

// What the map says about driving.
class Street {
 public:
  Street(const SemanticMap& map, const ClassTable& classes, const Eigen::AlignedBox3d& area)
      : states_(map), distances_(states_, area, {obstacles(classes), false}) {
    columns_.start({0.0, kLift + 2.0 * kHalf.z(), HeightReference::kGround});
    columns_.update(map, classes);
  }
  ColumnView columnAt(const Pose& at) const {
    const Eigen::Vector3d point(at.x(), at.y(), 0.0);
    const GridGeometry& grid = states_.geometry();
    const ColumnView* const column = grid.contains(point) ? columns_.find(grid.voxelAt(point)) : nullptr;
    return column ? *column : ColumnView();
  }
  // Whether the robot can stand there: on ground that is not forbidden, with all of its box in free space,
  // and within the area.
  bool isDrivable(const Pose& at) const {
    const ColumnView column = columnAt(at);
    if (std::isnan(column.ground) || column.cost >= 100 || !distances_.interpolate(centre(at))) return false;
    const Eigen::AngleAxisd turn(at.z(), Eigen::Vector3d::UnitZ());
    return contentOf(states_, OrientedBox{Eigen::Translation3d(centre(at)) * turn, kHalf}).isFree();
  }
  // Of a metre: 1, more on ground that costs, and more near obstacles. @param at drivable
  double costAt(const Pose& at) const {
    const double distance = distances_.interpolate(centre(at))->distance;
    return 1.0 + 0.05 * columnAt(at).cost + 3.0 * std::max(0.0, kClearance - distance);
  }

 private:
  static ClassFilter obstacles(const ClassTable& classes) {
    ClassFilter filter;
    for (const SemanticClass& c : classes.classes()) {
      if (!c.ground && !c.ignored) filter.insert(c.id);
    }
    return filter;
  }
  Eigen::Vector3d centre(const Pose& at) const {
    return {at.x(), at.y(), columnAt(at).ground + kLift + kHalf.z()};
  }

  StateMap states_;
  DistanceField distances_;
  ColumnMap columns_;
};

// @param curvature [1/m]
Arc arcFrom(Pose at, double curvature) {
  Arc arc;
  for (Pose& next : arc) {
    const double yaw = at.z() + 0.5 * kPeriod * curvature;
    at += kPeriod * Pose(std::cos(yaw), std::sin(yaw), curvature);
    next = at;
  }
  return arc;
}

std::vector<Pose> plan(const Street& street, const Pose& start, const Pose& goal) {
  struct Node {
    Arc arc;      // that ends here
    double cost;  // of the way from the start
    std::size_t parent;
  };
  Arc standing;
  standing.fill(start);
  std::vector<Node> nodes = {{standing, 0.0, 0}};
  // By the cost of the way and, at least, of the rest; the greatest is first, so costs are negative here.
  std::priority_queue<std::pair<double, std::size_t>> open;
  std::set<std::array<int, 3>> closed;  // of all ways to about the same pose, the cheapest goes on
  for (open.emplace(0.0, 0); !open.empty();) {
    const std::size_t n = open.top().second;
    const Node node = nodes[n];
    const Pose& at = node.arc.back();
    open.pop();
    const double turns = at.z() / (2.0 * M_PI);
    const Eigen::Array3d key(at.x() / 0.3, at.y() / 0.3, 36.0 * (turns - std::floor(turns)));
    const Eigen::Array3i cell = key.floor().cast<int>();
    if (!closed.insert({cell.x(), cell.y(), cell.z()}).second) continue;
    if ((at - goal).head<2>().norm() < 0.5 && std::cos(at.z() - goal.z()) > 0.95) {
      std::vector<Pose> path;
      for (std::size_t i = n; i != 0; i = nodes[i].parent) {
        path.insert(path.end(), nodes[i].arc.rbegin(), nodes[i].arc.rend());
      }
      path.push_back(start);
      return {path.rbegin(), path.rend()};
    }
    for (const double curvature : {-1.0 / kTurn, -0.5 / kTurn, 0.0, 0.5 / kTurn, 1.0 / kTurn}) {
      const Arc arc = arcFrom(at, curvature);
      if (!std::all_of(arc.begin(), arc.end(), [&](const Pose& p) { return street.isDrivable(p); })) continue;
      const double cost = node.cost + kPeriod * static_cast<double>(arc.size()) * street.costAt(arc.back());
      open.emplace(-cost - (arc.back() - goal).head<2>().norm(), nodes.size());
      nodes.push_back({arc, cost, n});
    }
  }
  throw std::runtime_error("the map shows no way from start to goal");
}

int main(int argc, char** argv) try {
  if (argc != 9) throw std::invalid_argument("give a map file, a class table, and X Y YAW of start and goal");
  Pose start, goal;
  for (int i = 0; i < 3; ++i) {
    start[i] = std::stod(argv[3 + i]);
    goal[i] = std::stod(argv[6 + i]);
  }
  const StoredMap stored = loadMapWithGains(argv[1]);
  const ClassTable classes = loadClassTable(argv[2]);  // with costs, which map files do not have
  for (const SemanticClass& each : stored.info.classes->classes()) {
    const SemanticClass* const own = classes.find(each.id);
    if (own && own->name == each.name) continue;
    throw std::invalid_argument("the class table lacks class '" + each.name +
                                "' of the map; give the map's own table");
  }
  Eigen::AlignedBox3d area;
  for (const DriveRecord& drive : stored.drives) area.extend(drive.bounds);
  const Street street(stored.map, classes, area);
  if (!street.isDrivable(start)) throw std::invalid_argument("the robot cannot stand at the start");
  if (!street.isDrivable(goal)) throw std::invalid_argument("the robot cannot stand at the goal");
  const std::vector<Pose> path = plan(street, start, goal);
  std::cout << "x,y,z,yaw,cost\n";
  for (const Pose& at : path) {
    const ColumnView column = street.columnAt(at);
    std::cout << at.x() << "," << at.y() << "," << column.ground << "," << at.z() << "," << int{column.cost}
              << "\n";
  }
} catch (const std::exception& error) {
  std::cerr << "plan_path: " << error.what() << "\n";
  return 1;
}
