#include "simulation/relief.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/plane_index.h"
#include "simulation/way.h"

namespace bki_mapping::simulation {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

/// A plane through the points as far as they determine it, level across a straight way.
/// @return its slopes along x and y, and its height at the origin.
Eigen::Vector3d planeThrough(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) mean += point / static_cast<double>(points.size());
  Eigen::Matrix2d square = 10.0 * static_cast<double>(points.size()) * Eigen::Matrix2d::Identity();
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d d = point - mean;
    square += d.head<2>() * d.head<2>().transpose();
    product += d.z() * d.head<2>();
  }
  const Eigen::Vector2d slope = square.inverse() * product;
  return {slope.x(), slope.y(), mean.z() - slope.dot(mean.head<2>())};
}

/// Mean of heights near by. Weights fall with the fourth power of the distance, and vanish at an end (Shepard
/// 1968; Franke and Nielson 1980).
class HeightMean {
 public:
  HeightMean(std::vector<Eigen::Vector3d> points, double end)
      : points_(std::move(points)), plane_(planeThrough(points_)), end_(end), index_(64.0) {
    for (std::size_t i = 0; i < points_.size(); ++i)
      index_.add(static_cast<std::uint32_t>(i), points_[i].head<2>());
  }
  double at(const Eigen::Vector2d& place) const {
    constexpr double kNear2 = 9.0;  // points within about 3 m count alike [m^2]
    double sum = 0.0, weights = 0.0;
    index_.forEachNear(place, end_, [&](std::uint32_t i) {
      const Eigen::Vector3d& point = points_[i];
      const double d2 = (point.head<2>() - place).squaredNorm();
      if (d2 >= end_ * end_) return;
      const double fade = 1.0 - std::sqrt(d2) / end_, weight = fade * fade / ((d2 + kNear2) * (d2 + kNear2));
      sum += weight * (point.z() - planeAt(point.head<2>()));
      weights += weight;
    });
    return planeAt(place) + sum / weights;
  }

 private:
  double planeAt(const Eigen::Vector2d& place) const { return plane_.head<2>().dot(place) + plane_.z(); }

  std::vector<Eigen::Vector3d> points_;
  Eigen::Vector3d plane_;
  double end_;
  PlaneIndex index_;
};

}  // namespace

Relief::Relief(const std::vector<Eigen::Vector3d>& way, const std::vector<Eigen::Vector2d>& axis) {
  constexpr double kTile = kEdge * kCells;
  const std::vector<Eigen::Vector3d> points = pointsAlong(way, kEdge);
  Eigen::AlignedBox2d bounds;
  for (const Eigen::Vector3d& point : points) bounds.extend(point.head<2>());
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(kReach);
  corner_ = kTile * ((bounds.min() - reach) / kTile).array().floor();
  const Eigen::Array2d tiles = ((bounds.max() + reach - corner_) / kTile).array().floor() + 1.0;
  columns_ = static_cast<int>(tiles.x());
  rows_ = static_cast<int>(tiles.y());
  tile_of_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), -1);

  PlaneIndex of_points(kTile), of_axis(kFarthestAxis);
  for (std::size_t i = 0; i < points.size(); ++i)
    of_points.add(static_cast<std::uint32_t>(i), points[i].head<2>());
  for (std::size_t i = 0; i < axis.size(); ++i) of_axis.add(static_cast<std::uint32_t>(i), axis[i]);
  const HeightMean mean(points, kReach + 1.5 * kTile);
  std::int32_t count = 0;
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector2d low = corner_ + kTile * Eigen::Vector2d(column, row);
      const Eigen::AlignedBox2d box(low, low + Eigen::Vector2d::Constant(kTile));
      double nearest = kEndless;
      of_points.forEachNear(box.center(), 0.5 * kTile + kReach, [&](std::uint32_t i) {
        nearest = std::min(nearest, box.exteriorDistance(Eigen::Vector2d(points[i].head<2>())));
      });
      if (nearest > kReach) continue;
      tile_of_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column)] = count++;
      for (int y = 0; y <= kCells; ++y) {
        for (int x = 0; x <= kCells; ++x) {
          const Eigen::Vector2d place = low + kEdge * Eigen::Vector2d(x, y);
          double from_axis = kFarthestAxis;
          of_axis.forEachNear(place, kFarthestAxis, [&](std::uint32_t i) {
            from_axis = std::min(from_axis, (axis[i] - place).norm());
          });
          nodes_.push_back({mean.at(place), from_axis});
        }
      }
    }
  }
}

Relief::Node Relief::at(double x, double y) const {
  constexpr double kTile = kEdge * kCells;
  const double u = (x - corner_.x()) / kTile, v = (y - corner_.y()) / kTile;
  if (!(u >= 0.0 && v >= 0.0 && u < columns_ && v < rows_)) return {-kEndless, kEndless};
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const std::int32_t tile = tile_of_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                                     static_cast<std::size_t>(column)];
  if (tile < 0) return {-kEndless, kEndless};
  const double in_x = (u - column) * kCells, in_y = (v - row) * kCells;
  const int i = std::min(static_cast<int>(in_x), kCells - 1),
            j = std::min(static_cast<int>(in_y), kCells - 1);
  const double a = in_x - i, b = in_y - j;
  constexpr int kNodes = kCells + 1;
  const Node* const n =
      &nodes_[static_cast<std::size_t>(tile) * kNodes * kNodes + static_cast<std::size_t>(j * kNodes + i)];
  const auto mix = [&](double Node::*value) {
    return (1.0 - b) * ((1.0 - a) * n[0].*value + a * n[1].*value) +
           b * ((1.0 - a) * n[kNodes].*value + a * n[kNodes + 1].*value);
  };
  return {mix(&Node::height), mix(&Node::from_axis)};
}

std::optional<double> Relief::hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                  double max_range) const {
  const auto above = [&](double range) {
    const Eigen::Vector3d at = origin + range * direction;
    return at.z() - heightAt(at.x(), at.y());
  };
  double from = 0.0, gap = above(0.0);
  if (!(gap > 0.0)) return std::nullopt;
  // Nothing of the ground is shorter than half the distance of its nodes, so no step misses anything.
  while (from < max_range && gap < kEndless) {
    const double to = from + 0.5 * kEdge, there = above(to);
    if (there <= 0.0) {
      double low = from, high = to, gap_low = gap, gap_high = there;
      for (int i = 0; i < 4 && gap_low > gap_high; ++i) {
        const double middle = low + (high - low) * gap_low / (gap_low - gap_high), here = above(middle);
        (here > 0.0 ? low : high) = middle;
        (here > 0.0 ? gap_low : gap_high) = here;
      }
      return gap_low - gap_high > 0.0 ? low + (high - low) * gap_low / (gap_low - gap_high) : low;
    }
    from = to;
    gap = there;
  }
  return std::nullopt;
}

}  // namespace bki_mapping::simulation
