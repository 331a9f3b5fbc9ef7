/// @file Clouds of voxels as streamed messages.
#pragma once

#include <bki_mapping/VoxelCloudUpdate.h>
#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/PointCloud2.h>

#include <memory>
#include <utility>
#include <vector>

#include "export/voxel_points.h"
#include "ros/cloud_frame.h"
#include "ros/server_snapshot.h"
#include "ros/voxel_pcl.h"
#include "streamed_message.h"

namespace bki_mapping::ros_interface {

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

/// A cloud of voxels.
struct CloudFields {
  using Message = sensor_msgs::PointCloud2;

  CloudFields() = default;
  /// @param snapshot must outlive this. @param in the frame of the cloud.
  CloudFields(const ServerSnapshot& snapshot, const VoxelSelection& selection, VoxelPoints::Blocks blocks,
              const CloudFrame& in)
      : data(snapshot, selection, std::move(blocks), in.origin()) {
    pcl_conversions::fromPCL(pclHeader(data.points()), frame);
    frame.header = snapshot.header;
    frame.header.frame_id = in.name(snapshot.header.frame_id);
  }

  template <typename Visit>
  void forEachMember(const Visit& visit) const {
    visit(frame.header);
    visit(frame.height);
    visit(frame.width);
    visit(frame.fields);
    visit(frame.is_bigendian);
    visit(frame.point_step);
    visit(frame.row_step);
    visit(data);
    visit(frame.is_dense);
  }

  sensor_msgs::PointCloud2 frame;  ///< all but the data
  StreamedArray<CloudData> data;
};
using StreamedCloud = StreamedMessage<CloudFields>;

struct CloudUpdateFields {
  using Message = VoxelCloudUpdate;

  template <typename Visit>
  void forEachMember(const Visit& visit) const {
    visit(header);
    visit(sequence);
    visit(whole);
    visit(resolution);
    visit(blocks);
    visit(cloud);
  }

  std_msgs::Header header;
  std::uint64_t sequence = 0;
  std::uint8_t whole = false;
  float resolution = 0.0f;
  std::vector<BlockCoordinates> blocks;
  StreamedCloud cloud;
};
using StreamedCloudUpdate = StreamedMessage<CloudUpdateFields>;

}  // namespace bki_mapping::ros_interface
