#include "bki_mapping/query/frontiers.h"

#include <algorithm>
#include <stdexcept>

#include "queries.h"
#include "requests.h"

namespace bki_mapping::ros_interface {

void query(const QueriedMap& map, const GetFrontiers::Request& asked, GetFrontiers::Response& answer) {
  std::vector<Frontier> found = frontiers(map.states, std::max(1u, asked.min_size));
  if (asked.max_count > 0 && found.size() > asked.max_count) found.resize(asked.max_count);
  if (asked.with_voxels) {
    std::size_t voxels = 0;
    for (const Frontier& frontier : found) voxels += frontier.voxels.size();
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
    answer.size.push_back(static_cast<std::uint32_t>(frontier.voxels.size()));
    if (!asked.with_voxels) continue;
    for (const VoxelIndex& voxel : frontier.voxels) {
      answer.voxels.push_back(fromVector(map.states.geometry().voxelCentre(voxel)));
    }
  }
}

}  // namespace bki_mapping::ros_interface
