#include "streamed_cloud.h"
#include "updates.h"

namespace bki_mapping::ros_interface {
namespace {

/// All known voxels.
VoxelSelection known() {
  return {{VoxelState::kOccupied, VoxelState::kFree, VoxelState::kOccluded}};
}

/// Makes a cloud of blocks, in a frame that follows them.
StreamedCloud cloudOf(const ServerSnapshot& snapshot, const VoxelSelection& selection,
                      VoxelPoints::Blocks blocks, CloudFrame& frame) {
  const GridGeometry& geometry = snapshot.map.geometry();
  if (!blocks.empty())
    frame.follow(placeOf(geometry, blocks), geometry.resolution(), snapshot.header.frame_id);
  return {snapshot, selection, std::move(blocks), frame};
}

class VoxelCloud : public MapPublisher {
 public:
  explicit VoxelCloud(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<StreamedCloud>("voxel_cloud", *this);
  }

 private:
  void publishNew(const ServerSnapshot& snapshot) override {
    VoxelSelection in_view = known();
    in_view.min_z = snapshot.config.view_min_z;
    in_view.max_z = snapshot.config.view_max_z;
    VoxelPoints::Blocks blocks = sortedBlocks(snapshot.map);
    const auto hidden = [&](const auto& block) { return !snapshot.inView(block.first); };
    blocks.erase(std::remove_if(blocks.begin(), blocks.end(), hidden), blocks.end());
    publisher_.publish(cloudOf(snapshot, in_view, std::move(blocks), frame_));
  }

  CloudFrame frame_;
};

class VoxelCloudUpdates : public UpdatePublisher<StreamedCloudUpdate> {
 public:
  explicit VoxelCloudUpdates(const PublisherContext& context)
      : UpdatePublisher(context, "voxel_cloud_updates") {}

 private:
  void fillWhole(const ServerSnapshot& snapshot, StreamedCloudUpdate& message) const override {
    message.cloud = cloudOf(snapshot, known(), sortedBlocks(snapshot.map), frame_);
  }
  void fillChanges(const ServerSnapshot& snapshot, StreamedCloudUpdate& message) const override {
    VoxelPoints::Blocks blocks;
    blocks.reserve(changed.blocks().size());
    message.blocks.reserve(changed.blocks().size());
    for (const GridIndex& index : changed.blocks()) {
      message.blocks.push_back(toMessage(index));
      if (const Block* block = snapshot.map.find({index})) blocks.emplace_back(BlockIndex{index}, block);
    }
    message.cloud = cloudOf(snapshot, known(), std::move(blocks), frame_);
  }

  mutable CloudFrame frame_;
};

}  // namespace

std::unique_ptr<MapPublisher> makeVoxelCloud(const PublisherContext& context) {
  return std::make_unique<VoxelCloud>(context);
}

std::unique_ptr<MapPublisher> makeVoxelCloudUpdates(const PublisherContext& context) {
  return std::make_unique<VoxelCloudUpdates>(context);
}

}  // namespace bki_mapping::ros_interface
