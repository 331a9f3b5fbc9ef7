#include "ros/map_publisher.h"

namespace bki_mapping::ros_interface {

// Each file beside this one makes one publisher, or two of a kind.
std::unique_ptr<MapPublisher> makeOccupiedCells(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeFreeCells(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeVoxelCloud(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeVoxelCloudUpdates(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeProjectedMap(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeOccupancy(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeOccupancyUpdates(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeElevationMap(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeTrajectory(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeDistanceSection(const PublisherContext& context);

std::vector<std::unique_ptr<MapPublisher>> makePublishers(const PublisherContext& context) {
  std::vector<std::unique_ptr<MapPublisher>> publishers;
  publishers.push_back(makeOccupiedCells(context));  // occupied_cells_vis_array
  publishers.push_back(makeFreeCells(context));      // free_cells_vis_array
  publishers.push_back(makeVoxelCloud(context));     // voxel_cloud
  publishers.push_back(makeVoxelCloudUpdates(context));
  publishers.push_back(makeProjectedMap(context));  // projected_map
  publishers.push_back(makeOccupancy(context));     // occupancy
  publishers.push_back(makeOccupancyUpdates(context));
  publishers.push_back(makeElevationMap(context));
  publishers.push_back(makeTrajectory(context));  // trajectory
  publishers.push_back(makeDistanceSection(context));
  return publishers;
}

}  // namespace bki_mapping::ros_interface
