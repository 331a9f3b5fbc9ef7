#include <chrono>
#include <limits>
#include <optional>
#include <stdexcept>

#include "bki_mapping/query/queries.h"
#include "queries.h"
#include "requests.h"

namespace bki_mapping::ros_interface {

void query(const QueriedMap& map, const GetNearestObstacles::Request& asked,
           GetNearestObstacles::Response& answer) {
  const std::size_t count = asked.points.size();
  checkBatch(count, GetNearestObstacles::Request::MOST_POINTS, "points");
  const ClassFilter classes = classesOf(map.classes, asked.classes, asked.all_but);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double most = asked.max_distance == 0.0 ? kInfinity : asked.max_distance;
  const Eigen::Vector3d nowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  answer.header = map.header;
  // Where the map has no such class, each point takes a look at every block.
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end =
      Clock::now() + std::chrono::seconds(GetNearestObstacles::Request::MOST_SECONDS);
  for (std::size_t n = 0; n < count; ++n) {
    if (Clock::now() > end) {
      throw std::invalid_argument("the call takes more than " +
                                  std::to_string(GetNearestObstacles::Request::MOST_SECONDS) +
                                  " s; set max_distance, or split it");
    }
    std::optional<NearestObstacle> found;
    try {
      found = nearestObstacle(map.states, toVector(asked.points[n]), classes, most);
    } catch (const std::invalid_argument& fault) {
      throw std::invalid_argument("point " + std::to_string(n) + ": " + fault.what());
    }
    answer.distance.push_back(found ? found->distance : kInfinity);
    answer.obstacle.push_back(fromVector(found ? map.states.geometry().voxelCentre(found->voxel) : nowhere));
    answer.class_name.push_back(found ? map.classes.nameOf(found->label) : "");
  }
}

}  // namespace bki_mapping::ros_interface
