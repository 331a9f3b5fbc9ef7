/// @file Ground that rises and falls along a street.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace bki_mapping::simulation {

/// Ground around a way, whose height is a smooth mean of the heights of the way near by, and how far from the
/// axis of its street each place is. The ground ends where it is farther than 150 m from the way.
class Relief {
 public:
  /// @param way points on the ground along the way, at least one [m]. @param axis points of the axis, at
  /// most about 1 m apart [m].
  Relief(const std::vector<Eigen::Vector3d>& way, const std::vector<Eigen::Vector2d>& axis);

  /// Height of the ground [m]; -infinity where there is none.
  double heightAt(double x, double y) const { return at(x, y).height; }
  /// Distance to the axis of the street, up to 12 m; infinity where there is no ground [m].
  double fromAxis(double x, double y) const { return at(x, y).from_axis; }
  /// Distance along a ray to the ground [m]; nullopt if it does not reach it within the range, or starts
  /// under it. @param direction unit vector.
  std::optional<double> hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double max_range) const;

 private:
  struct Node {
    double height, from_axis;
  };
  static constexpr double kEdge = 2.0;     ///< distance of nodes, between which the ground is bilinear [m]
  static constexpr int kCells = 32;        ///< along the edge of a tile
  static constexpr double kReach = 150.0;  ///< to the end of the ground [m]
  static constexpr double kFarthestAxis = 12.0;

  Node at(double x, double y) const;

  Eigen::Vector2d corner_;             ///< of the tile with the least coordinates [m]
  int columns_ = 0, rows_ = 0;         ///< number of tiles along x and y
  std::vector<std::int32_t> tile_of_;  ///< where the nodes of each tile are; -1: there is no ground
  std::vector<Node> nodes_;            ///< (kCells + 1)^2 of each tile
};

}  // namespace bki_mapping::simulation
