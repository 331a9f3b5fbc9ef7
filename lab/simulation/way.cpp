#include "simulation/way.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping::simulation {
namespace {

constexpr double kApart = 1.0;   ///< of corners; positions nearer to the last corner are skipped [m]
constexpr double kSmooth = 2.5;  ///< the heading is that of the chord from so far behind to so far ahead [m]

/// The direction from a corner to the first one that is far enough from it.
Eigen::Vector2d directionFrom(const std::vector<Eigen::Vector2d>& corners) {
  for (const Eigen::Vector2d& corner : corners) {
    const Eigen::Vector2d to = corner - corners.front();
    if (to.norm() >= 2.0 * kSmooth || (to.norm() > 0.0 && &corner == &corners.back())) return to.normalized();
  }
  return Eigen::Vector2d::UnitX();
}

}  // namespace

Eigen::Vector2d WayPoint::beside(double left) const {
  return position + left * Eigen::Vector2d(-std::sin(heading), std::cos(heading));
}

Way::Way(const std::vector<Eigen::Vector3d>& positions, double ahead) : ahead_(ahead) {
  double length = 0.0;
  for (const Eigen::Vector3d& position : positions) {
    const Eigen::Vector2d here = position.head<2>();
    const double way = corners_.empty() ? 0.0 : (here - corners_.back()).norm();
    if (corners_.empty() || way >= kApart) {
      length += way;
      corners_.push_back(here);
      lengths_.push_back(length);
    }
    driven_.push_back(length + (corners_.back() - here).norm());
  }
  // What follows the last corner is shorter than a metre. A sensor that waits does not go back on its way.
  for (std::size_t i = 1; i < driven_.size(); ++i) driven_[i] = std::max(driven_[i], driven_[i - 1]);
  const Eigen::Vector2d start = directionFrom(corners_);
  const Eigen::Vector2d stop =
      corners_.size() == 1 ? Eigen::Vector2d(-start) : directionFrom({corners_.rbegin(), corners_.rend()});
  corners_.insert(corners_.begin(), corners_.front() - ahead * start);
  lengths_.insert(lengths_.begin(), -ahead);
  corners_.push_back(corners_.back() - (ahead + kApart) * stop);
  lengths_.push_back(length + ahead + kApart);
}

Eigen::Vector2d Way::positionAt(double length) const {
  const auto after = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, length);
  const auto i = static_cast<std::size_t>(after - lengths_.begin());
  const double part = (length - lengths_[i - 1]) / (lengths_[i] - lengths_[i - 1]);
  return corners_[i - 1] + part * (corners_[i] - corners_[i - 1]);
}

WayPoint Way::at(double length) const {
  const Eigen::Vector2d chord = positionAt(length + kSmooth) - positionAt(length - kSmooth);
  return {positionAt(length), std::atan2(chord.y(), chord.x())};
}

std::vector<Eigen::Vector3d> pointsAlong(const std::vector<Eigen::Vector3d>& positions, double step) {
  std::vector<Eigen::Vector3d> points{positions.front()};
  for (std::size_t i = 1; i < positions.size(); ++i) {
    const Eigen::Vector3d from = points.back(), to = positions[i];
    const double way = (to - from).head<2>().norm();
    if (way < 0.5 * step && i + 1 < positions.size()) continue;
    const int parts = std::max(1, static_cast<int>(std::ceil(way / step)));
    for (int part = 1; part <= parts; ++part) points.push_back(from + (to - from) * part / parts);
  }
  return points;
}

}  // namespace bki_mapping::simulation
