#include <bki_mapping/VoxelCloudUpdate.h>
#include <sensor_msgs/PointCloud2.h>

#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "export/voxel_points.h"
#include "ros/cloud_frame.h"
#include "ros/server_snapshot.h"
#include "streamed_message.h"
#include "updates.h"

namespace bki_mapping::ros_interface {
namespace {

/// The field `data` of a PointCloud2 of voxels.
class CloudData {
 public:
  CloudData() = default;  ///< no points
  /// Counts the points. @param snapshot must outlive this. @param origin of the coordinates [m].
  CloudData(const ServerSnapshot& snapshot, const VoxelSelection& selection, VoxelPoints::Blocks blocks,
            const Eigen::Vector3d& origin)
      : content_(std::make_shared<Content>(snapshot, selection, std::move(blocks))), origin_(origin) {}

  std::size_t points() const { return content_ ? content_->points.count() : 0; }
  std::uint32_t bytes() const { return messageBytes(points(), sizeof(VoxelPoint)); }
  std::uint32_t count() const { return bytes(); }  ///< elements of the array `data`
  void write(std::uint8_t* to) const {
    if (content_) content_->points.write(reinterpret_cast<VoxelPoint*>(to), origin_);
  }

 private:
  struct Content {
    Content(const ServerSnapshot& snapshot, const VoxelSelection& selection, VoxelPoints::Blocks blocks)
        : pool(snapshot.threadsFor(blocks.size())),
          points(snapshot.map, snapshot.rules, snapshot.classes, selection, std::move(blocks), pool) {}

    ThreadPool pool;
    VoxelPoints points;
  };

  std::shared_ptr<const Content> content_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
};

/// A cloud of `count` VoxelPoints, without their data. @throws std::length_error if a cloud cannot hold so
/// many.
sensor_msgs::PointCloud2 cloudOfSize(std::size_t count) {
  if (count > std::numeric_limits<std::uint32_t>::max() / sizeof(VoxelPoint)) {
    throw std::length_error(std::to_string(count) + " voxels are more than a point cloud can hold");
  }
  sensor_msgs::PointCloud2 cloud;
  for (const VoxelField& field : kVoxelFields) {
    cloud.fields.emplace_back();
    cloud.fields.back().name = field.name;
    cloud.fields.back().offset = field.offset;
    cloud.fields.back().datatype = field.type;
    cloud.fields.back().count = 1;
  }
  cloud.point_step = sizeof(VoxelPoint);
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(count);
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.is_dense = true;
  return cloud;
}

/// A cloud of voxels.
struct CloudFields {
  using Message = sensor_msgs::PointCloud2;

  CloudFields() = default;
  /// @param snapshot must outlive this. @param in the frame of the cloud.
  CloudFields(const ServerSnapshot& snapshot, const VoxelSelection& selection, VoxelPoints::Blocks blocks,
              const CloudFrame& in)
      : data(snapshot, selection, std::move(blocks), in.origin()) {
    frame = cloudOfSize(data.points());
    frame.header = snapshot.header;
    frame.header.frame_id = in.name(snapshot.header.frame_id);
  }

  template <typename Visit>
  void visitMembers(const Visit& visit) const {
    visit(frame.header, frame.height, frame.width, frame.fields, frame.is_bigendian, frame.point_step,
          frame.row_step, data, frame.is_dense);
  }

  sensor_msgs::PointCloud2 frame;  ///< all but the data
  StreamedArray<CloudData> data;
};
using StreamedCloud = StreamedMessage<CloudFields>;

struct CloudUpdateFields {
  using Message = VoxelCloudUpdate;

  template <typename Visit>
  void visitMembers(const Visit& visit) const {
    visit(header, sequence, whole, resolution, blocks, cloud);
  }

  std_msgs::Header header;
  std::uint64_t sequence = 0;
  std::uint8_t whole = false;
  float resolution = 0.0f;
  std::vector<BlockCoordinates> blocks;
  StreamedCloud cloud;
};
using StreamedCloudUpdate = StreamedMessage<CloudUpdateFields>;

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
