#include <nav_msgs/OccupancyGrid.h>

#include <algorithm>

#include "bki_mapping/core/map_query.h"
#include "bki_mapping/ros/map_publisher.h"

namespace bki_mapping::ros_shell {
namespace {

constexpr std::int8_t kUnknownCell = -1, kFreeCell = 0, kOccupiedCell = 100;

/// The map seen from above: a cell is occupied if any voxel above it is, between occupancy_min_z and
/// occupancy_max_z; free if any is free and none occupied; unknown otherwise.
class ProjectedMap : public MapPublisher {
 public:
  explicit ProjectedMap(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<nav_msgs::OccupancyGrid>("projected_map", *this);
  }

 private:
  void publishNew(const MapSnapshot& snapshot) override {
    const SemanticMap& map = snapshot.mapper.map();
    nav_msgs::OccupancyGrid grid;
    grid.header = snapshot.header;
    grid.info.map_load_time = snapshot.header.stamp;
    grid.info.resolution = static_cast<float>(map.geometry().resolution());
    grid.info.origin.orientation.w = 1.0;
    if (map.size() > 0) fill(snapshot, grid);
    publisher_.publish(grid);
  }

  static void fill(const MapSnapshot& snapshot, nav_msgs::OccupancyGrid& grid) {
    const SemanticMap& map = snapshot.mapper.map();
    const ServerConfig& config = snapshot.config;
    BlockIndex low = map.entries().front().index, high = low;
    for (const auto& entry : map.entries()) {
      low.x = std::min(low.x, entry.index.x);
      low.y = std::min(low.y, entry.index.y);
      high.x = std::max(high.x, entry.index.x);
      high.y = std::max(high.y, entry.index.y);
    }
    const Eigen::Vector3d corner = map.geometry().blockOrigin(low);
    grid.info.origin.position.x = corner.x();
    grid.info.origin.position.y = corner.y();
    grid.info.width = static_cast<std::uint32_t>((high.x - low.x + 1) * kBlockEdge);
    grid.info.height = static_cast<std::uint32_t>((high.y - low.y + 1) * kBlockEdge);
    grid.data.assign(std::size_t{grid.info.width} * grid.info.height, kUnknownCell);
    forEachKnownVoxel(map, [&](const VoxelIndex& voxel, const VoxelView& view) {
      const double z = map.geometry().voxelCentre(voxel).z();
      if (z < config.occupancy_min_z || z > config.occupancy_max_z || view.state == VoxelState::kOccluded)
        return;
      const auto column = static_cast<std::size_t>(voxel.x - low.x * kBlockEdge);
      const auto row = static_cast<std::size_t>(voxel.y - low.y * kBlockEdge);
      std::int8_t& cell = grid.data[row * grid.info.width + column];
      cell = std::max(cell, view.state == VoxelState::kOccupied ? kOccupiedCell : kFreeCell);
    });
  }
};

}  // namespace

std::unique_ptr<MapPublisher> makeProjectedMap(const PublisherContext& context) {
  return std::make_unique<ProjectedMap>(context);
}

}  // namespace bki_mapping::ros_shell
