#include "bki_mapping/query/queries.h"

#include <cmath>
#include <stdexcept>

#include "queries.h"
#include "requests.h"
#include "ros/class_info.h"

namespace bki_mapping::ros_interface {
namespace {

/// @throws std::invalid_argument if the section has too many cells for a message. (A side that is not finite,
/// or negative, is left to the section itself.)
void checkSize(const GetSection::Request& asked, double resolution) {
  const Eigen::Vector3d sides = toVector(asked.end) - toVector(asked.start);
  const double width = asked.vertical ? sides.head<2>().norm() : sides.x(),
               height = asked.vertical ? sides.z() : sides.y();
  const double cells = (width / resolution + 1.0) * (height / resolution + 1.0);
  if (width >= 0.0 && height >= 0.0 && cells > GetSection::Request::MOST_CELLS) {
    throw std::invalid_argument("the section has " + numberText(std::round(cells)) +
                                " cells; make it smaller, " +
                                std::to_string(GetSection::Request::MOST_CELLS) + " are the most");
  }
}

Section sectionOf(const StateMap& states, const GetSection::Request& asked) {
  const Eigen::Vector3d from = toVector(asked.start), to = toVector(asked.end);
  if (asked.vertical) return verticalSection(states, from.head<2>(), to.head<2>(), from.z(), to.z());
  return horizontalSection(states, from.z(), {from.head<2>(), to.head<2>()});
}

}  // namespace

void query(const QueriedMap& map, const GetSection::Request& asked, GetSection::Response& answer) {
  checkSize(asked, map.states.geometry().resolution());
  const Section section = sectionOf(map.states, asked);
  nav_msgs::OccupancyGrid& grid = answer.grid;
  grid.header = map.header;
  grid.info.map_load_time = map.header.stamp;
  grid.info.resolution = static_cast<float>(section.resolution);
  grid.info.width = static_cast<std::uint32_t>(section.width);
  grid.info.height = static_cast<std::uint32_t>(section.height);
  grid.info.origin.position = fromVector(section.origin);
  Eigen::Matrix3d axes;
  axes << section.right, section.up, section.right.cross(section.up);
  const Eigen::Quaterniond rotation(axes);
  grid.info.origin.orientation.x = rotation.x();
  grid.info.origin.orientation.y = rotation.y();
  grid.info.origin.orientation.z = rotation.z();
  grid.info.origin.orientation.w = rotation.w();
  grid.data.reserve(section.states.size());
  for (const VoxelState state : section.states) {
    constexpr std::int8_t kOccupied = 100, kFree = 0, kUnknown = -1;
    grid.data.push_back(state == VoxelState::kOccupied ? kOccupied
                        : state == VoxelState::kFree   ? kFree
                                                       : kUnknown);
  }
  answer.label = section.labels;
  std::array<bool, 256> present{};
  for (const ClassId label : section.labels) present[label] = true;
  for (const SemanticClass& each : map.classes.classes()) {
    if (present[each.id]) answer.classes.push_back(toMessage(each));
  }
}

}  // namespace bki_mapping::ros_interface
