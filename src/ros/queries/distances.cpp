#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bki_mapping/query/distance_field.h"
#include "queries.h"
#include "requests.h"

namespace bki_mapping::ros_interface {
namespace {

/// The box in which obstacles can be within max_distance of a point. @throws std::invalid_argument.
Eigen::AlignedBox3d regionOf(const std::vector<Eigen::Vector3d>& points, double max_distance,
                             const GridGeometry& geometry) {
  Eigen::AlignedBox3d region;
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (!geometry.contains(points[n])) {
      throw std::invalid_argument("point " + std::to_string(n) +
                                  " is not finite or lies beyond the map's grid; give one within the map");
    }
    region.extend(points[n]);
  }
  // A point is interpolated from voxels whose centres are up to a voxel away.
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(max_distance + geometry.resolution());
  region.min() -= reach;
  region.max() += reach;
  const double voxels = (region.sizes().array() / geometry.resolution() + 1.0).prod();
  if (voxels > GetDistances::Request::MOST_VOXELS) {
    throw std::invalid_argument("the box around the points and max_distance has " +
                                numberText(std::round(voxels)) + " voxels; " +
                                "lower max_distance or split the points, " +
                                numberText(GetDistances::Request::MOST_VOXELS) + " are the most");
  }
  return region;
}

}  // namespace

void query(const QueriedMap& map, const GetDistances::Request& asked, GetDistances::Response& answer) {
  const std::size_t count = asked.points.size();
  checkBatch(count, GetDistances::Request::MOST_POINTS, "points");
  const double most = asked.max_distance;
  if (!(most > 0.0)) throw std::invalid_argument("max_distance is not a number > 0; give metres > 0");
  const ObstacleRules rules = {classesOf(map.classes, asked.classes, asked.all_but),
                               asked.unknown_is_obstacle != 0};
  answer.header = map.header;
  if (count == 0) return;
  const std::vector<Eigen::Vector3d> points = toVectors(asked.points);
  const DistanceField field(map.states, regionOf(points, most, map.states.geometry()), rules);
  answer.distance.reserve(count);
  answer.gradient.reserve(count);
  for (const Eigen::Vector3d& point : points) {
    const DistanceField::Value value = field.interpolate(point).value();
    const bool cut = !(std::abs(static_cast<double>(value.distance)) <= most);
    answer.distance.push_back(static_cast<float>(std::clamp<double>(value.distance, -most, most)));
    answer.gradient.emplace_back();
    if (!cut) answer.gradient.back() = fromVector<geometry_msgs::Vector3>(value.gradient.cast<double>());
  }
}

}  // namespace bki_mapping::ros_interface
