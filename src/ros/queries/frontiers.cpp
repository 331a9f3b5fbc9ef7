#include "bki_mapping/query/queries.h"

#include <Eigen/Geometry>
#include <stdexcept>

#include "queries.h"
#include "requests.h"

namespace bki_mapping::ros_interface {

std::optional<Eigen::AlignedBox3d> boxOf(const GetFrontiers::Request& asked) {
  const Eigen::AlignedBox3d box(toVector(asked.min), toVector(asked.max));
  if (box.min().isZero(0.0) && box.max().isZero(0.0)) return std::nullopt;
  return box;
}

void query(const QueriedMap& map, const GetFrontiers::Request& asked, GetFrontiers::Response& answer) {
  FrontierRules rules;
  rules.min_size = asked.min_size;
  rules.with_voxels = asked.with_voxels;
  rules.box = boxOf(asked);
  std::vector<Frontier> found = frontiers(map.states, rules);
  if (asked.max_count > 0 && found.size() > asked.max_count) found.resize(asked.max_count);
  if (asked.with_voxels) {
    std::size_t voxels = 0;
    for (const Frontier& frontier : found) voxels += frontier.size;
    if (voxels > GetFrontiers::Request::MOST_VOXELS) {
      throw std::invalid_argument("the frontiers have " + std::to_string(voxels) + " voxels, of which " +
                                  std::to_string(GetFrontiers::Request::MOST_VOXELS) +
                                  " can be listed; raise min_size, or set max_count");
    }
    answer.voxels.reserve(voxels);
  }
  answer.header = map.header;
  for (const Frontier& frontier : found) {
    answer.centre.push_back(fromVector(frontier.centre));
    answer.size.push_back(static_cast<std::uint32_t>(frontier.size));
    for (const VoxelIndex& voxel : frontier.voxels) {
      answer.voxels.push_back(fromVector(map.states.geometry().voxelCentre(voxel)));
    }
  }
}

}  // namespace bki_mapping::ros_interface
