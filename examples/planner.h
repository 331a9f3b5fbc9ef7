// The planner of plan_path: hybrid A*, which searches among arcs that the robot can drive, on the map and, if
// given, around what moves.
#pragma once

#include <bki_mapping/query/column_map.h>
#include <bki_mapping/query/distance_field.h>
#include <bki_mapping/query/queries.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace planner {

using namespace bki_mapping;

inline const Eigen::Vector3d kHalf(0.6, 0.4, 0.5);  // half extents of the robot [m]
constexpr double kLift = 0.1;                       // of its box above the ground [m]
constexpr double kTurn = 1.5;                       // its turning radius [m]
constexpr double kClearance = 1.0;                  // that it keeps from obstacles where there is room [m]
constexpr double kPeriod = 0.1;                     // between the poses of a path [m]
constexpr double kSpeed = 1.2;                      // [m/s]

using Pose = Eigen::Vector3d;     // x, y [m], yaw [rad]
using Arc = std::array<Pose, 6>;  // poses one after another

// What moves, or may do so, as a lidar sees it: boxes around hits of classes that can move, with velocities
// from scan to scan. The map is no source for this: it shows where something was a while ago, if at all.
class Movers {
 public:
  // @param hits of the newest scan, on classes that can move, map frame [m]. @param time [s].
  void update(const std::vector<Eigen::Vector2d>& hits, double time) {
    std::vector<Mover> now;
    std::map<std::pair<int, int>, std::vector<Eigen::Vector2d>> cells;
    for (const Eigen::Vector2d& hit : hits) cells[cellOf(hit)].push_back(hit);
    while (!cells.empty()) {  // cells that touch are one thing
      Mover mover;
      std::vector<std::pair<int, int>> open = {cells.begin()->first};
      while (!open.empty()) {
        const auto [x, y] = open.back();
        open.pop_back();
        const auto cell = cells.find({x, y});
        if (cell == cells.end()) continue;
        for (const Eigen::Vector2d& hit : cell->second) mover.box.extend(hit);
        cells.erase(cell);
        for (int n = 0; n < 9; ++n) open.emplace_back(x + n % 3 - 1, y + n / 3 - 1);
      }
      now.push_back(mover);
    }
    const double passed = time - time_;
    for (Mover& mover : now) {
      double nearest = kMaxSpeed * passed;
      for (const Mover& before : movers_) {
        const Eigen::Vector2d expected = before.box.center() + passed * before.velocity;
        const double distance = (mover.box.center() - expected).norm();
        if (distance >= nearest) continue;
        nearest = distance;
        const Eigen::Vector2d measured = (mover.box.center() - before.box.center()) / passed;
        mover.velocity = before.seen == 1 ? measured : Eigen::Vector2d(0.5 * (before.velocity + measured));
        mover.seen = before.seen + 1;
      }
    }
    movers_ = std::move(now);
    time_ = time;
  }
  // Whether the robot keeps clear of all at a pose that it reaches some time after the last update [s].
  bool areClearOf(const Pose& at, double after) const {
    constexpr double kMargin = 0.3, kDoubt = 0.08, kHorizon = 8.0, kDisc = 0.5;
    const Eigen::Vector2d ahead(std::cos(at.z()), std::sin(at.z()));
    for (const Mover& mover : movers_) {
      const double speed = mover.velocity.norm();
      if (after > kHorizon || (speed < 0.3 && mover.seen > 3)) continue;  // what stands is in the map
      const double reach = kDisc + kMargin + kDoubt * speed * after;
      for (const double along : {-0.3, 0.3}) {  // two discs cover the robot
        const Eigen::Vector2d point = at.head<2>() + along * ahead - after * mover.velocity;
        if (mover.box.squaredExteriorDistance(point) < reach * reach) return false;
      }
    }
    return true;
  }

 private:
  struct Mover {
    Eigen::AlignedBox2d box;
    Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
    int seen = 1;  // in how many scans
  };
  static constexpr double kMaxSpeed = 12.0;  // [m/s]

  static std::pair<int, int> cellOf(const Eigen::Vector2d& point) {
    constexpr double kCell = 0.5;
    return {static_cast<int>(std::floor(point.x() / kCell)), static_cast<int>(std::floor(point.y() / kCell))};
  }

  std::vector<Mover> movers_;
  double time_ = 0.0;
};

// What the map says about driving.
class Street {
 public:
  Street(const SemanticMap& map, const StateRules& rules, const ClassTable& classes,
         const Eigen::AlignedBox3d& area)
      : states_(map, rules), distances_(states_, area, {obstacles(classes), false}) {
    columns_.start({0.0, kLift + 2.0 * kHalf.z(), HeightReference::kGround});
    columns_.update(map, rules, classes);
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
inline Arc arcFrom(Pose at, double curvature) {
  Arc arc;
  for (Pose& next : arc) {
    const double yaw = at.z() + 0.5 * kPeriod * curvature;
    at += kPeriod * Pose(std::cos(yaw), std::sin(yaw), curvature);
    next = at;
  }
  return arc;
}

// A path of poses kPeriod apart, which the robot drives at kSpeed. @param movers must outlive the call;
// nullptr: nothing moves. @param haste above 1: a way that is found sooner, and may cost as many times more.
// @param most of ways' ends that are looked at, before the search gives up.
// @throws std::runtime_error if there is none.
inline std::vector<Pose> plan(const Street& street, const Pose& start, const Pose& goal,
                              const Movers* movers = nullptr, double haste = 1.0,
                              std::size_t most = 1000000) {
  struct Node {
    Arc arc;      // that ends here
    double cost;  // of the way from the start
    std::size_t parent;
    int arcs = 0;  // from the start
  };
  Arc standing;
  standing.fill(start);
  std::vector<Node> nodes = {{standing, 0.0, 0, 0}};
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
    if (closed.size() > most) break;
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
      double after = static_cast<double>(arc.size()) * node.arcs * kPeriod / kSpeed;
      const bool clear = std::all_of(arc.begin(), arc.end(), [&](const Pose& p) {
        after += kPeriod / kSpeed;
        return street.isDrivable(p) && (!movers || movers->areClearOf(p, after));
      });
      if (!clear) continue;
      const double cost = node.cost + kPeriod * static_cast<double>(arc.size()) * street.costAt(arc.back());
      open.emplace(-cost - haste * (arc.back() - goal).head<2>().norm(), nodes.size());
      nodes.push_back({arc, cost, n, node.arcs + 1});
    }
  }
  throw std::runtime_error("the map shows no way from start to goal");
}

}  // namespace planner
