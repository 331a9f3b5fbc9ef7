#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/PointCloud2.h>

#include "bki_mapping/io/map_export.h"
#include "bki_mapping/io/voxel_pcl.h"
#include "bki_mapping/ros/map_publisher.h"

namespace bki_mapping::ros_shell {
namespace {

/// All known voxels as points, with the fields of the PCD file.
class VoxelCloud : public MapPublisher {
 public:
  explicit VoxelCloud(const PublisherContext& context) {
    publisher_ = context.advertise<sensor_msgs::PointCloud2>("voxel_cloud");
  }

  void publish(const MapSnapshot& snapshot) override {
    const auto voxels = collectVoxels(snapshot.mapper.map(), snapshot.mapper.classes(),
                                      {VoxelState::kOccupied, VoxelState::kFree, VoxelState::kOccluded});
    pcl::PCLPointCloud2 cloud = toPcl(voxels);
    sensor_msgs::PointCloud2 message;
    pcl_conversions::moveFromPCL(cloud, message);
    message.header = snapshot.header;
    publisher_.publish(message);
  }
};

}  // namespace

std::unique_ptr<MapPublisher> makeVoxelCloud(const PublisherContext& context) {
  return std::make_unique<VoxelCloud>(context);
}

}  // namespace bki_mapping::ros_shell
