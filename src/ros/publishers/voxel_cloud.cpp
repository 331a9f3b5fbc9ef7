#include <bki_mapping/VoxelCloudUpdate.h>
#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/PointCloud2.h>

#include <algorithm>

#include "bki_mapping/io/map_export.h"
#include "io/voxel_pcl.h"
#include "updates.h"

namespace bki_mapping::ros_interface {
namespace {

/// Collects the known voxels of blocks, as points with the fields of PCD files.
class CloudBuilder {
 public:
  explicit CloudBuilder(const MapSnapshot& snapshot) : snapshot_(snapshot) {}

  void add(const BlockIndex& index, const Block& block) {
    appendVoxels(snapshot_.map, snapshot_.classes,
                 {VoxelState::kOccupied, VoxelState::kFree, VoxelState::kOccluded}, index, block, voxels_);
  }
  void addAll(bool in_view) {
    for (const auto& [index, block] : sortedBlocks(snapshot_.map)) {
      if (!in_view || snapshot_.inView(index)) add(index, *block);
    }
    const auto hidden = [&](const VoxelRecord& v) {
      return !snapshot_.heightInView(static_cast<double>(v.z));
    };
    if (in_view) voxels_.erase(std::remove_if(voxels_.begin(), voxels_.end(), hidden), voxels_.end());
  }
  sensor_msgs::PointCloud2 cloud() const {
    pcl::PCLPointCloud2 cloud = toPcl(voxels_);
    sensor_msgs::PointCloud2 message;
    pcl_conversions::moveFromPCL(cloud, message);
    message.header = snapshot_.header;
    return message;
  }

 private:
  const MapSnapshot& snapshot_;
  std::vector<VoxelRecord> voxels_;
};

class VoxelCloud : public MapPublisher {
 public:
  explicit VoxelCloud(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<sensor_msgs::PointCloud2>("voxel_cloud", *this);
  }

 private:
  void publishNew(const MapSnapshot& snapshot) override {
    CloudBuilder builder(snapshot);
    builder.addAll(true);
    publisher_.publish(builder.cloud());
  }
};

class VoxelCloudUpdates : public UpdatePublisher<VoxelCloudUpdate> {
 public:
  explicit VoxelCloudUpdates(const PublisherContext& context)
      : UpdatePublisher(context, "voxel_cloud_updates") {}

 private:
  void fillWhole(const MapSnapshot& snapshot, VoxelCloudUpdate& message) const override {
    CloudBuilder builder(snapshot);
    builder.addAll(false);
    message.cloud = builder.cloud();
  }
  void fillChanges(const MapSnapshot& snapshot, VoxelCloudUpdate& message) const override {
    CloudBuilder builder(snapshot);
    message.blocks.reserve(changed.blocks().size());
    for (const GridIndex& index : changed.blocks()) {
      message.blocks.push_back(toMessage(index));
      if (const Block* block = snapshot.map.find({index})) builder.add({index}, *block);
    }
    message.cloud = builder.cloud();
  }
};

}  // namespace

std::unique_ptr<MapPublisher> makeVoxelCloud(const PublisherContext& context) {
  return std::make_unique<VoxelCloud>(context);
}

std::unique_ptr<MapPublisher> makeVoxelCloudUpdates(const PublisherContext& context) {
  return std::make_unique<VoxelCloudUpdates>(context);
}

}  // namespace bki_mapping::ros_interface
